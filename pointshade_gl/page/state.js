// Where the viewer and the light are: plain values and their arithmetic, no GL, no page. The functions, their names and
// their order are those of scene/orbit.py; a test compares them. Vectors are arrays, matrices arrays of rows.

const RIM = 0.5; // share of the picture's smaller side between the object's middle and its rim
const FARTHEST = (175 / 180) * Math.PI; // radians from the viewer's direction
const DEGREES = 120; // around the object, for a drag across the picture's smaller side
const SLOWS = 25, NEAR_END = 40, ENDS = 50; // degrees from where a single frame was taken: drags turn it less, and end
const END_TEXT = "drags end here: the other sides were not measured";
const WHEEL = 1.1; // factor on distances per step of the wheel
const LEAST = 1e-6; // of a distance: it must not be 0
const VERTICAL = [0, 1, 0]; // of the picture: what yaw turns about, unless the stage has another axis
const NOT_LIT = ["none", "edl"]; // of the shadings: show the things' own colours
const START = {
  yaw: 0, pitch: 0, distance: 1, pan: [0, 0], pivot: [0, 0, 0],
  lightAt: [-0.3, -0.3], lightReach: 1, lightMode: true, lightColor: [1, 1, 1], lightIntensity: 1,
  lit: true, shadows: false, shading: "phong",
};

const limited = (x, low, high) => Math.min(Math.max(x, low), high);
const radians = (degrees) => (degrees * Math.PI) / 180;
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const plus = (a, b) => a.map((x, k) => x + b[k]);
const times = (a, factor) => a.map((x) => x * factor);
const transposed = (matrix) => matrix[0].map((_, column) => matrix.map((row) => row[column]));
const applied = (matrix, vector) => matrix.map((row) => dot(row, vector));
const product = (a, b) => a.map((row) => transposed(b).map((column) => dot(row, column)));
const rotation = (pose) => pose.slice(0, 3).map((row) => row.slice(0, 3));
const translation = (pose) => pose.slice(0, 3).map((row) => row[3]);

// After a drag by (dx, dy) pixels: the near side of the object follows. In light mode the light stays with the viewer.
function orbited(state, dx, dy, smallerSide, { axis = VERTICAL, oneSided = false } = {}) {
  const right = (-dx / smallerSide) * DEGREES, up = (dy / smallerSide) * DEGREES;
  const degrees = (oneSided ? softlyTurned(state.yaw, right) : state.yaw + right) + 180;
  const yaw = degrees - 360 * Math.floor(degrees / 360) - 180;
  const pitch = oneSided ? softlyTurned(state.pitch, up) : limited(state.pitch + up, -89, 89);
  const turned = { ...state, yaw, pitch };
  if (state.lightMode) return turned;
  return withLightDirection(turned, applied(transposed(turn(turned, axis)), applied(turn(state, axis), towards(state))));
}

// After a drag by (dx, dy) pixels; the picture's focal length is in pixels.
function panned(state, dx, dy, focal) {
  return { ...state, pan: [state.pan[0] + dx / focal, state.pan[1] + dy / focal] };
}

function zoomed(state, steps) {
  const nearest = Math.min(0.05, state.distance), farthest = Math.max(20, state.distance); // a pivot may lie beyond both
  return { ...state, distance: limited(state.distance / WHEEL ** steps, nearest, farthest) };
}

// The same picture and light; orbits turn around another point in front of the viewer, view axes.
function withPivot(state, point, stage) {
  const turned = applied(turn(state, stage.axis), plus(point, times(seenPivot(state, stage), -1)));
  const [x, y, z] = point, [u, v, depth] = stage.pivot;
  return { ...state, pivot: plus(state.pivot, turned), distance: z / depth, pan: [x / z - u / depth, y / z - v / depth] };
}

function lightReached(state, steps) {
  return { ...state, lightReach: limited(state.lightReach * WHEEL ** steps, 0.1, 20) };
}

// The light in another direction: from the object's middle, view axes, of any length.
function withLightDirection(state, [x, y, z]) {
  const angle = Math.atan2(Math.hypot(x, y), -z), around = Math.atan2(y, x);
  const rims = angle / (Math.PI / 2);
  return { ...state, lightAt: [rims * Math.cos(around), rims * Math.sin(around)] };
}

// The light where another one of the same axes is; viewer: 4x4 of who looks.
function withLight(state, { position, direction }, stage, viewer) {
  const toView = product(stage.upright, transposed(rotation(viewer)));
  if (!position) return withLightDirection(state, times(applied(toView, direction), -1));
  return withLightDirection(state, plus(applied(toView, plus(position, times(translation(viewer), -1))), times(seenMiddle(state, stage), -1)));
}

// Of length 1, from the object's middle to the light, view axes.
function towards(state) {
  const angle = Math.min((Math.hypot(...state.lightAt) * Math.PI) / 2, FARTHEST);
  const around = Math.atan2(state.lightAt[1], state.lightAt[0]);
  const side = Math.sin(angle);
  return [side * Math.cos(around), side * Math.sin(around), -Math.cos(angle)];
}

function isNearEnd(state, stage) {
  return Boolean(stage.oneSided) && Math.max(Math.abs(state.yaw), Math.abs(state.pitch)) > NEAR_END;
}

function isLit(state) {
  return state.lit && !NOT_LIT.includes(state.shading);
}

function isBehind(state) {
  return Math.hypot(...state.lightAt) > 1;
}

// What orbits turn around, view axes.
function seenPivot(state, stage) {
  const shift = times([...state.pan, 0], stage.pivot[2]);
  return times(plus(stage.pivot, shift), state.distance);
}

// The object's middle, view axes: the light moves around it.
function seenMiddle(state, stage) {
  return plus(seenPivot(state, stage), times(applied(transposed(turn(state, stage.axis)), state.pivot), -1));
}

// 4x4 of the viewer, to the axes of the frame's camera.
function pose(state, stage) {
  const turned = turn(state, stage.axis);
  const turning = product(product(stage.upright, turned), stage.upright);
  const way = times(applied(turned, seenPivot(state, stage)), -1);
  const place = applied(stage.upright, plus(plus(stage.pivot, state.pivot), way));
  return [...turning.map((row, k) => [...row, place[k]]), [0, 0, 0, 1]];
}

// The light in the world, directed at the object's middle. The kind says which of position and direction it has.
function light(state, stage, framePose, kind) {
  const direction = towards(state);
  const place = plus(seenMiddle(state, stage), times(direction, stage.radius * state.lightReach));
  const viewer = product(framePose, pose(state, stage));
  const toWorld = product(rotation(viewer), stage.upright);
  const hasDirection = !kind.position || kind.direction;
  return {
    ...kind,
    position: kind.position ? plus(applied(toWorld, place), translation(viewer)) : null,
    direction: hasDirection ? applied(toWorld, times(direction, -1)) : null,
    color: state.lightColor,
    intensity: state.lightIntensity,
  };
}

// The object's middle in pixels, kept inside the picture, so that the light stays within reach.
function middle(state, stage, camera) {
  const [x, y, depth] = seenMiddle(state, stage);
  const z = Math.max(depth, LEAST * stage.pivot[2]); // behind the viewer it is at the side where it left the picture
  const u = (camera.fx * x) / z + camera.cx, v = (Math.abs(camera.fy) * y) / z + camera.cy;
  return [limited(u, 0, camera.width - 1), limited(v, 0, camera.height - 1)];
}

// View and light as in another state; the shading stays.
function resetView(state, start) {
  return { ...start, shading: state.shading };
}

// The place of the light, in rims, that a pixel of the picture stands for.
// An angle after a drag by so many degrees, one long or many short ones: away from 0 it ends softly.
function softlyTurned(angle, by) {
  const side = by > 0 ? 1 : -1, free = Math.min(side * by, Math.max(SLOWS - side * angle, 0));
  const turned = side * angle + free;
  return side * (turned < ENDS ? ENDS - (ENDS - turned) * Math.exp(-(side * by - free) / (ENDS - SLOWS)) : turned);
}

function rimsFrom(middle, x, y, camera) {
  const rim = RIM * Math.min(camera.width, camera.height);
  return [(x - middle[0]) / rim, (y - middle[1]) / rim];
}

// Where the light's marker is drawn, in pixels of the picture.
function markerPlace(state, stage, camera) {
  const rim = RIM * Math.min(camera.width, camera.height);
  const [x, y] = middle(state, stage, camera);
  return [x + state.lightAt[0] * rim, y + state.lightAt[1] * rim];
}

// 3x3: yaw about an axis of length 1, then pitch (scene/camera.py orbit_pose).
function turn(state, axis = VERTICAL) {
  const a = radians(state.yaw), b = radians(state.pitch), [x, y, z] = axis, across = [[0, z, -y], [-z, 0, x], [y, -x, 0]];
  const turnY = across.map((row, i) => row.map((value, j) => (i === j) * Math.cos(a) + (1 - Math.cos(a)) * axis[i] * axis[j] + Math.sin(a) * value));
  const turnX = [[1, 0, 0], [0, Math.cos(b), Math.sin(b)], [0, -Math.sin(b), Math.cos(b)]];
  return product(turnY, turnX);
}

// The whole view of a camera, undistorted, in the middle of a picture of another size and shape (Camera.fitted).
function fitted(camera, width, height) {
  const scale = Math.min(width / camera.width, height / camera.height);
  const cx = (camera.cx - (camera.width - 1) / 2) * scale + (width - 1) / 2;
  const cy = (camera.cy - (camera.height - 1) / 2) * scale + (height - 1) / 2;
  return { fx: camera.fx * scale, fy: camera.fy * scale, cx, cy, width, height };
}
