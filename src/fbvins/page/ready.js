// SPDX-License-Identifier: Apache-2.0
// --- theme, size, ready ----------------------------------------------------------------------------------------------
const root = document.documentElement, themeButton = document.getElementById("theme");
function setTheme(name) { root.dataset.theme = name; themeButton.textContent = name === "dark" ? "Light" : "Dark"; }
setTheme(location.hash === "#dark" || (location.hash !== "#light" && matchMedia("(prefers-color-scheme: dark)").matches) ? "dark" : "light");
themeButton.addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
document.getElementById("unzoom").addEventListener("click", () => { zoom = null; redraw(); });
addEventListener("resize", redraw);
redraw();
root.setAttribute("data-ready", charts.length);
