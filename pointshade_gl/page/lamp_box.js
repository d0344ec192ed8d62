// The box with the colour and the strength of the light that the mouse holds.

const STRONGEST = 10; // of the slider, unless the light is stronger at the start

const encoded = (c) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
const decoded = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);

// Linear red, green and blue as browsers write colours, and back.
const hexOf = (color) => `#${color.map((c) => Math.round(255 * encoded(limited(c, 0, 1))).toString(16).padStart(2, "0")).join("")}`;
const colorOf = (hex) => [1, 3, 5].map((k) => decoded(parseInt(hex.slice(k, k + 2), 16) / 255));

const strongest = (start) => Math.max(STRONGEST, 2 * start.lightIntensity);

// The slider is finer where light is weak.
function showLamp({ lightColor, lightIntensity }, start) {
  const [color, strength] = [byId("color"), byId("strength")];
  if (color.value !== hexOf(lightColor)) color.value = hexOf(lightColor);
  if (document.activeElement !== strength) strength.value = Math.cbrt(lightIntensity / strongest(start));
  byId("strong").textContent = lightIntensity.toPrecision(2);
}

function toggleLamp(isOpen) {
  const box = byId("lamp-box"), hadFocus = box.contains(document.activeElement);
  box.hidden = !isOpen;
  byId("lamp").setAttribute("aria-expanded", isOpen);
  if (isOpen) byId("strength").focus();
  else if (hadFocus) byId("lamp").focus();
}

// Changes of the light while someone chooses.
function listenToLamp(start, set) {
  byId("color").addEventListener("input", (event) => set({ lightColor: colorOf(event.target.value) }));
  byId("strength").addEventListener("input", (event) => set({ lightIntensity: strongest(start) * event.target.value ** 3 }));
}
