// SPDX-License-Identifier: Apache-2.0
// Asks for the token of a program whose address was opened without it.

const FORM = `
  <form method="dialog">
    <h2 id="token-title">A token is needed</h2>
    <p>It is in the address that the program printed, after <code>#token=</code>.</p>
    <label>Token <input id="token" autocomplete="off" spellcheck="false"></label>
    <button type="submit">Watch</button>
  </form>`;

/// `use(token)` is called with what was entered. It is asked for once at a time.
export function askForToken(use) {
  if (document.getElementById("token-dialog")) return;
  const dialog = document.body.appendChild(document.createElement("dialog"));
  dialog.id = "token-dialog";
  dialog.setAttribute("aria-labelledby", "token-title");
  dialog.innerHTML = FORM;
  dialog.addEventListener("close", () => {
    const token = dialog.querySelector("input").value;
    dialog.remove();
    use(token);
  });
  dialog.showModal();
}
