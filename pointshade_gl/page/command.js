// The `pointshade render ...` line that makes the picture that is seen (cli/command_lines.py), and what pages hand out.

const DIGITS = 12; // of a number: far more than pictures show
const PLAIN_LIGHT = {
  position: null, direction: null, color: [1, 1, 1], intensity: 1, attenuation: [1, 0, 0], cone: [0, 45], shadow: false,
  radius: 0, angle: 0, size: null,
};

const numberText = (x) => String(Number(x.toPrecision(DIGITS)) + 0);
const numbersText = (value) => [value].flat().map(numberText).join(",");
const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`);

// data: that of the page, with its command: { line, shading, isScene, isOwn, turns, home }; seen: { state, camera, lights, view, shading }.
function commandLine({ command, exposure, fill, samples, around }, { state, camera, lights, view, shading }, name) {
  const words = shading === command.shading ? [] : ["--shading", shading];
  if (!NOT_LIT.includes(shading)) {
    const shining = lights.filter((one) => one.intensity > 0), isBare = around.bands && !shining.length;
    for (const one of isBare ? [] : shining.length ? shining : lights.slice(0, 1)) words.push("--light", lightText(one, state.shadows, command));
    if (exposure !== 1 || fill) words.push("--exposure", numberText(Math.log2(exposure)));
    if (fill) words.push("--fill", numberText(fill));
  }
  words.push(...poseWords(state, view.pose, command), "--picture-size", `${camera.width}x${camera.height}`);
  return [command.line, ...[...words, "--samples", `${samples}`, "-o", name].map(quoted)].join(" ");
}

// A light of home axes in words. Those of scenes cast shadows unless they say no; isScene null: so its words say yes or no.
function lightText(light, shadows, { home, isScene }) {
  const turn = rotation(home), plain = { ...PLAIN_LIGHT, shadow: isScene };
  const position = light.position && plus(applied(turn, light.position), translation(home));
  const direction = light.direction && applied(turn, light.direction);
  const said = { ...light, position, direction, shadow: light.shadow && shadows };
  const names = Object.keys(plain).filter((name) => said[name] !== null && String(said[name]) !== String(plain[name]));
  return names.map((name) => `${name}=${name === "shadow" ? (said.shadow ? "yes" : "no") : numbersText(said[name])}`).join(" ");
}

// How the view is turned, if it only is; otherwise where it is.
function poseWords({ yaw, pitch, distance, pan, pivot }, pose, { home, isOwn, turns }) {
  if (isOwn && pose.flat().every((x, k) => Math.abs(x - HOME.flat()[k]) < 1e-12)) return [];
  if (!turns || [...pan, ...pivot].some(Boolean)) return ["--pose", numbersText(poseNumbers(product(home, pose)))];
  const said = { yaw, pitch, dolly: 1 - distance };
  return Object.entries(said).flatMap(([name, value]) => (numberText(value) === "0" ? [] : [`--${name}`, numberText(value)]));
}

// tx, ty, tz, qx, qy, qz, qw.
function poseNumbers(pose) {
  const [[a, b, c], [d, e, f], [g, h, i]] = rotation(pose), largest = Math.max(a + e + i, a, e, i);
  const q = largest === a + e + i ? [h - f, c - g, d - b, 1 + a + e + i]
    : largest === a ? [1 + a - e - i, b + d, c + g, h - f]
    : largest === e ? [b + d, 1 + e - a - i, f + h, c - g]
    : [c + g, f + h, 1 + i - a - e, d - b];
  return [...translation(pose), ...times(q, 1 / Math.hypot(...q))];
}

// A name for the file of a picture.
function fileName(title) {
  const name = title.replace(/[\\/:*?"<>|\u0000-\u001f]+/g, "-").replace(/^[\s.-]+|[\s.]+$/g, "").slice(0, 100);
  return `${name || "pointshade"}.png`;
}

// Whether a text could be copied. Frames of other pages may only by the old way.
async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = Object.assign(document.createElement("textarea"), { value: text }), before = document.activeElement;
    document.body.append(area);
    area.select();
    const isDone = document.execCommand("copy");
    area.remove();
    before?.focus();
    return isDone;
  }
}
