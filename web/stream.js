// SPDX-License-Identifier: Apache-2.0
// The connection: messages in, commands out, reconnecting when it breaks. The messages are described in docs/web.md.
import { askForToken } from "./token_dialog.js";

const HEAD_BYTES = 24;
const KINDS = { 1: "image", 2: "points", 3: "cloud" };
const AGAIN_MS = 2000;

/// A binary message: 24 bytes, then `count` times four numbers, then the rest.
export function decode(buffer) {
  const view = new DataView(buffer);
  const count = view.getUint32(4, true), end = HEAD_BYTES + 16 * count;
  if (end > buffer.byteLength) throw new RangeError("a message ends too early");
  return {
    type: KINDS[view.getUint8(0)],
    camera: view.getUint16(2, true),
    t_s: view.getFloat64(8, true),
    width_px: view.getUint32(16, true),
    height_px: view.getUint32(20, true),
    count,
    numbers: new Float32Array(buffer, HEAD_BYTES, 4 * count),
    ids: new Uint32Array(buffer, HEAD_BYTES, 4 * count),
    rest: new Uint8Array(buffer, end),
  };
}

export class Stream {
  /// `handlers`: message(message), open(), lost(), and, if wanted, refused(), after which a token is asked for.
  constructor(handlers) {
    this.handlers = handlers;
    this.token = new URLSearchParams(location.hash.slice(1)).get("token") ?? "";
    document.addEventListener("visibilitychange", () => this.look());
    this.connect();
  }

  /// A hidden page disconnects, to save the radio link.
  look() {
    if (document.hidden) this.socket?.close();
    else if (!this.socket) this.connect();
  }

  connect() {
    clearTimeout(this.again);
    const socket = new WebSocket(`ws://${location.host}/stream?token=${this.token}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    let opened = false;
    socket.onopen = () => { opened = true; this.handlers.open(); };
    socket.onmessage = event => this.handlers.message(typeof event.data === "string" ? JSON.parse(event.data) : decode(event.data));
    socket.onclose = () => {
      this.socket = undefined;
      if (document.hidden) return;
      this.handlers.lost();
      this.again = setTimeout(() => this.connect(), AGAIN_MS);
      if (!opened) this.askWhy();
    };
  }

  /// A browser does not tell why a WebSocket was refused; a plain request does.
  async askWhy() {
    const answer = await fetch(`/stream?token=${this.token}`).catch(() => undefined);
    if (answer?.status !== 401) return;
    clearTimeout(this.again);
    this.handlers.refused?.();
    askForToken(token => this.useToken(token));
  }

  useToken(token) {
    this.token = encodeURIComponent(token.trim());
    this.connect();
  }

  send(command) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}
