// What keys and buttons do, and when the picture is drawn: after something has changed, and finer when all rests.
//
// data      what page_file.py puts into the page: camera {fx, fy, cx, cy, width, height}; stage {pivot, radius, upright, axis, oneSided};
//           start, what differs from START; held, the light that the mouse holds; lights, the others; background, CSS
// drawing   what createDrawing(canvas, data) gives, a promise or not: draw(view, lights, options), with
//           view {camera, pose}, camera in pixels of the canvas, pose camera-to-home, lights in home axes; options
//           {shading, shadows}; refine(), isFine, isBusy

const REST = 200; // milliseconds that nothing moves before the picture is refined: moving must not wait for it
const MOST_PIXELS = 4e6; // of the canvas: sharper ones only cost time
const KEY_TURN = 5; // degrees per key
const KEY_LIGHT = 0.1; // rims per key
const KEY_SHIFT = 0.04; // of the picture's smaller side per key
const HOME = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]; // of the camera that the stage stands before
const GREETINGS = {
  mouse: "Move the mouse: the light follows. Drag to turn.",
  touch: "Move a finger: the light follows. Two fingers turn.",
  unlit: "Drag, or use two fingers, to turn. Unlit, or B, lights it.",
};

const OF_FOCUS = /^( |Arrow.*|Page.*|Home|End|Enter|Tab)$/; // keys that press a button or move a slider that has the focus

const byId = (id) => document.getElementById(id);

// Shows the page. Gives, for a console: ready, a promise that is kept when something is shown; data, drawing; state.
function control(canvas, data) {
  const start = { ...START, ...data.start };
  const isEmbedded = window !== window.top;
  let state = start;
  let drawing = null;
  let camera = fitted(data.camera, data.camera.width, data.camera.height);
  let ratio = 1; // canvas pixels per CSS pixel
  let frameAsked = false;
  let saving = ""; // "fine": with all samples, "soon": with the first
  const markers = [byId("marker"), ...data.lights.map(() => byId("marker").cloneNode())]; // one for each light
  byId("marker").after(...markers.slice(1));
  for (const marker of markers.slice(1)) marker.removeAttribute("id");
  const refining = makeRefining(() => (isPhotograph() || (player && player.isPlaying) ? null : drawing), showSaving);

  function change(next, text) {
    if (saving) next = { ...next, lightAt: state.lightAt }; // the mouse leaves the button
    if (saving && JSON.stringify(next) === JSON.stringify(state)) return;
    if (saving && !write()) return;
    if (text) say(text);
    if (next === state) return;
    state = next;
    showState();
    redraw();
  }

  function redraw() {
    if (frameAsked) return;
    frameAsked = true;
    requestAnimationFrame(() => {
      frameAsked = false;
      if (!drawing || !drawing.isSlow || !drawing.isBusy) return draw();
      refining.stop(); // no picture waits for others that are old when they come
      redraw();
    });
  }

  function draw() {
    if (!drawing) return;
    const { view, lights, shading } = seen();
    drawing.draw(view, lights, { shading, shadows: state.shadows, hurries: drawing.isSlow || (player && player.isPlaying) });
    document.body.classList.add("live");
    refining.start(saving ? 0 : REST);
  }

  function seen() {
    const home = player ? player.way : HOME, lights = [light(state, data.stage, home, data.held), ...data.lights];
    return { state, camera, lights, home, view: { camera, pose: product(home, pose(state, data.stage)) }, shading: state.lit ? state.shading : "none" };
  }

  // Whether a frame is seen as it was taken: it has no more samples, and stays sharp.
  function isPhotograph() {
    const isOwn = camera.width === data.camera.width && camera.height === data.camera.height, { view, home, shading } = seen();
    const isThere = view.pose.flat().every((x, k) => Math.abs(x - home.flat()[k]) < 1e-9 * data.stage.radius);
    return shading === "none" && isOwn && isThere && data.things.length === 1 && data.things[0].kind === "points";
  }

  // Saves the picture at its best; asked again, or before something else is shown, as it is.
  function save() {
    if (!drawing) return;
    if (saving) return write();
    saving = "fine";
    if (!frameAsked) refining.start(0);
    showSaving();
  }

  // After each turn.
  function showSaving() {
    if (!saving) return;
    if ((!frameAsked && refining.isDone) || (saving === "soon" && drawing.isShown)) return write();
    const done = Math.round((100 * drawing.count) / data.samples), now = drawing.isShown && saving === "fine" ? ", P saves it as it is" : "";
    say(`saving: ${done} % refined${now}`);
  }

  // Writes the picture to a file, if more than a coarse one is there. Tells whether.
  function write() {
    saving = drawing.isShown ? "" : "soon";
    if (saving) return false;
    drawing.present(); // what a canvas shows is gone after a while
    const name = fileName(document.title);
    canvas.toBlob((file) => {
      const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(file), download: name });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60000);
      say(`saved as ${name}`);
    });
    return true;
  }

  async function copy() {
    if (!data.command) say("this page knows no command");
    else say((await copied(commandLine(data, seen(), fileName(document.title)))) ? "the command is copied" : "this browser lets no page copy");
  }

  // Marker and buttons as the state has them.
  function showState() {
    const { lights, view } = seen(), [u, v] = middle(state, data.stage, camera);
    markers.forEach((marker, k) => {
      const shown = k ? withLight(state, lights[k], data.stage, view.pose) : state;
      marker.hidden = !drawing || !isLit(state) || !lights[k].intensity;
      const place = markerPlace(shown, data.stage, camera), [x, y] = place.map((one) => (one + 0.5) / ratio);
      const across = limited(x, 8, camera.width / ratio - 8), down = limited(y, 8, camera.height / ratio - 8);
      marker.style.transform = `translate(${across}px, ${down}px) rotate(${Math.atan2(v - place[1], u - place[0])}rad) scale(${k ? 0.65 : 1})`;
      marker.style.color = `rgb(${lights[k].color.map((c) => Math.round(255 * limited(c, 0, 1) ** (1 / 2.2)))})`;
      marker.classList.toggle("behind", isBehind(shown));
      marker.classList.toggle("ahead", distance(place, [u, v]) < 8 * ratio);
    });
    document.body.classList.toggle("lighting", state.lightMode && !markers[0].hidden);
    for (const [id, on] of [["follow", state.lightMode], ["unlit", !state.lit], ["shadows", state.shadows]])
      byId(id).setAttribute("aria-pressed", on);
    byId("shading").value = state.shading;
    showLamp(state, start);
  }

  function resize() {
    const { width, height } = canvas.getBoundingClientRect();
    if (!width || !height) return;
    ratio = Math.min(window.devicePixelRatio, Math.sqrt(MOST_PIXELS / (width * height)));
    canvas.width = Math.max(1, Math.round(width * ratio));
    canvas.height = Math.max(1, Math.round(height * ratio));
    camera = fitted(data.camera, canvas.width, canvas.height);
    showState();
    draw(); // at once: a canvas of another size is empty
  }

  let silence = 0;
  function say(text, seconds = 2.5) {
    byId("message").textContent = text;
    document.body.classList.add("talking");
    clearTimeout(silence);
    silence = setTimeout(() => document.body.classList.remove("talking"), 1000 * seconds);
  }

  async function begin() {
    try {
      const made = await createDrawing(canvas, data);
      if (player) await player.attach(made);
      if (made.layer) made.layer.changed = redraw;
      drawing = made;
      resize();
    } catch (error) {
      drawing = null;
      stayStill(error.message);
    }
  }

  function stayStill(reason) {
    document.body.classList.remove("live");
    canvas.hidden = byId("tools").hidden = true;
    byId("note").hidden = false;
    byId("note").textContent = `A still picture: ${reason}`;
  }

  const player = makePlayer(data, () => drawing && draw());
  const actions = { ...makeActions(() => state, change, start, data), save, copy };
  const pointers = makePointers(data.stage, () => ({ state, camera, ratio, drawing }), change);
  listenToPointers(canvas, pointers, isEmbedded);
  listenToKeys({ ...actions, play: () => player && player.toggle() });
  listenToButtons(actions);
  listenToLamp(start, actions.set);
  byId("copy").hidden = document.querySelector("tr.copy").hidden = !data.command;
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault(); // or it never comes back
    drawing = null;
    saving = "";
    document.body.classList.remove("live");
    showState();
  });
  canvas.addEventListener("webglcontextrestored", begin);
  new ResizeObserver(resize).observe(canvas);
  const wake = () => document.body.classList.toggle("awake", !isEmbedded || document.hasFocus());
  for (const name of ["focus", "blur"]) window.addEventListener(name, wake);
  wake();
  byId("left-out").hidden = !data.leftOut.length;
  byId("left-out").textContent = `Here ${data.leftOut.join("; ")}.`;
  if (data.background) document.body.style.setProperty("--ground", data.background);
  canvas.hidden = byId("tools").hidden = false;
  say(GREETINGS[!start.lit ? "unlit" : matchMedia("(pointer: coarse)").matches ? "touch" : "mouse"], 6);
  const ready = begin();
  return {
    ready, data, player, get drawing() { return drawing; }, refining, seen, get state() { return state; },
    set state(next) { change(next); },
  };
}

// Adds samples to the picture after nothing has moved for a while, one a turn: what moves waits for no more than that.
function makeRefining(current, turned) {
  let timer = 0, turn = 0, began = 0;

  function next() {
    const drawing = current();
    if (!drawing || drawing.isFine) return turned();
    const isBusy = drawing.isBusy, rest = began + REST - performance.now(); // asked often, it tells how long pictures take
    if (!isBusy && rest > 0) {
      timer = setTimeout(next, rest);
      return;
    }
    if (!isBusy) {
      drawing.refine();
      turned();
    }
    turn = requestAnimationFrame(next);
  }

  function stop() {
    clearTimeout(timer);
    cancelAnimationFrame(turn);
  }

  function start(rest) {
    stop();
    began = performance.now() + rest - REST;
    turn = requestAnimationFrame(next);
  }

  return { start, stop, get isDone() { return !current() || current().isFine; } };
}

// The actions of keys and buttons, by name.
function makeActions(current, change, start, { camera, stage }) {
  const set = (changes, text) => change({ ...current(), ...changes }, text);
  return {
    follow() {
      const on = !current().lightMode;
      set({ lightMode: on }, on ? "the light follows" : "the light stays where it is");
    },
    unlit() {
      const lit = !current().lit;
      set({ lit }, lit ? "lit" : "unlit, as photographed");
    },
    shadows() {
      const on = !current().shadows;
      set({ shadows: on }, on ? "shadows on" : "shadows off");
    },
    shade(shading) {
      set({ shading, lit: true }, `shading: ${shading}`);
    },
    reset: () => change(resetView(current(), start), "view and light are reset"),
    turn(x, y) {
      const next = orbited(current(), x * KEY_TURN, y * KEY_TURN, DEGREES, stage);
      change(next, isNearEnd(next, stage) ? END_TEXT : "");
    },
    shift: (x, y) => change(panned(current(), x * KEY_SHIFT, y * KEY_SHIFT, camera.fx / Math.min(camera.width, camera.height))),
    zoom: (steps) => change(zoomed(current(), steps)),
    reach: (steps) => change(lightReached(current(), steps)),
    moveLight(x, y) {
      const [u, v] = current().lightAt;
      const place = [u + x * KEY_LIGHT, v + y * KEY_LIGHT];
      set({ lightAt: times(place, Math.min(1, FARTHEST / (Math.PI / 2) / Math.hypot(...place))) });
    },
    full: () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
    set,
    toggleLamp: () => toggleLamp(byId("lamp-box").hidden),
    help: () => (byId("help").open ? byId("help").close() : byId("help").showModal()),
  };
}

function listenToKeys(actions) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const keys = {
    l: actions.follow, b: actions.unlit, s: actions.shadows, i: actions.toggleLamp, r: actions.reset, p: actions.save,
    c: actions.copy, f: actions.full, h: actions.help, "?": actions.help,
    "+": () => actions.zoom(1), "=": () => actions.zoom(1), "-": () => actions.zoom(-1),
    ",": () => actions.reach(-1), ".": () => actions.reach(1), " ": actions.play,
  };
  SHADINGS.forEach((shading, k) => (keys[k + 1] = () => actions.shade(shading)));
  const showFocus = (is) => document.body.classList.toggle("tabbing", is); // a frame is for those who move by the tab key
  document.addEventListener("pointerdown", () => showFocus(false));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Tab") showFocus(true);
    if (event.key === "Escape" && !byId("lamp-box").hidden) toggleLamp(false);
    if (event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    if (event.target.tagName === (event.key === " " ? "BUTTON" : "INPUT") && OF_FOCUS.test(event.key)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if ((byId("help").open && !"h?".includes(key)) || (event.repeat && key === "p")) return;
    if (arrows[key]) (event.ctrlKey ? actions.shift : event.shiftKey ? actions.moveLight : actions.turn)(...arrows[key]);
    else if (keys[key] && !event.ctrlKey) keys[key]();
    else return;
    event.preventDefault();
  });
}

function listenToButtons(actions) {
  for (const [id, act] of [["follow", actions.follow], ["unlit", actions.unlit], ["shadows", actions.shadows],
    ["lamp", actions.toggleLamp], ["reset", actions.reset], ["save", actions.save], ["copy", actions.copy], ["full", actions.full], ["ask", actions.help], ["close", actions.help]])
    byId(id).addEventListener("click", act);
  byId("shading").addEventListener("change", ({ target }) => {
    actions.shade(target.value);
    if (!target.matches(":focus-visible")) byId("picture").focus(); // the mouse chose: keys are the picture's again
  });
  byId("help").addEventListener("click", (event) => event.target === byId("help") && byId("help").close()); // beside it
  byId("full").hidden = !document.fullscreenEnabled;
}

const pageData = JSON.parse(byId("data").textContent);
for (const part of ["shaders", "parts"]) pageData[part] = byId(part).textContent;
if (pageData.film) pageData.film.texts = [...document.querySelectorAll("script.frame")].map((one) => one.textContent);
window.pointshade = control(byId("picture"), pageData);
