// SPDX-License-Identifier: Apache-2.0
// Decodes a camera's images, one at a time; meanwhile only the newest one waits.

export class PictureDecoder {
  /// `decoded(picture, message)` is called with each image that was decoded.
  constructor(decoded) { this.decoded = decoded; }

  async decode(message) {
    this.waiting = message;
    if (this.decoding) return;
    this.decoding = true;
    while (this.waiting) {
      const newest = this.waiting;
      this.waiting = undefined;
      const picture = await createImageBitmap(new Blob([newest.rest], { type: "image/jpeg" })).catch(() => undefined);
      if (picture) this.decoded(picture, newest);
    }
    this.decoding = false;
  }

  clear() { this.waiting = undefined; }
}
