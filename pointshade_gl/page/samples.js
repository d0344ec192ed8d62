// Where the samples of a picture lie: in their pixels, and on lights. The functions and their numbers are those of
// scene/sample_pattern.py; a test compares them. World axes but for positions and directions of lights.

const IN_PIXEL = [0.7548776662466927, 0.5698402909980532];
const ON_LIGHT = [Math.sqrt(2) % 1, Math.sqrt(3) % 1, Math.sqrt(5) % 1];
const UPRIGHT = 1e-6; // of a unit vector: what lies farther from the y axis is not along it

// Where sample k lies in a square with sides of 1: the middle first, then pairs that face each other across it.
function inSquare(k, steps) {
  const side = k % 2 ? 1 : -1, j = Math.floor((k + 1) / 2);
  return steps.map((step) => side * (((0.5 + j * step) % 1) - 0.5));
}

// Where it lies in a light of radius 1, seen along z: its middle first.
function ballPoint(k) {
  const [area, turns, along] = ON_LIGHT.map((step) => (k * step) % 1);
  const across = Math.sqrt(area), around = 2 * Math.PI * turns;
  const depth = Math.sqrt(1 - area) * Math.sin(2 * Math.PI * along);
  return [across * Math.cos(around), across * Math.sin(around), depth];
}

// The camera of sample k.
function shiftedCamera(camera, k) {
  const [dx, dy] = inSquare(k, IN_PIXEL);
  return { ...camera, cx: camera.cx - dx, cy: camera.cy - dy };
}

// The light of sample k, in home axes: at the middle of a part of a light with a radius, an angle or a size. centre: of
// what it lights.
function movedLight(light, k, centre, toWorld) {
  if (k === 0 || !(light.radius || light.angle || light.size)) return light;
  const along = (offset, axes) => applied(transposed(product(axes, toWorld)), offset); // to home axes
  const placed = (offset) => ({ ...light, position: plus(light.position, offset) });
  const within = Math.sqrt(1 - lightPart(k) ** 2);
  if (light.size) {
    const offset = inSquare(k, ON_LIGHT.slice(0, 2)).map((x, axis) => within * x * light.size[axis]);
    return placed(along(offset, levelAxes(unit(applied(toWorld, light.direction)))));
  }
  const offset = times(ballPoint(k), within);
  if (!light.position) {
    const towards = unit(light.direction), reach = Math.tan(radians(light.angle) / 2);
    const aside = along(times(offset.slice(0, 2), reach), acrossAxes(applied(toWorld, towards)));
    return { ...light, direction: plus(towards, aside) };
  }
  const toCentre = applied(toWorld, minus(centre, light.position));
  const towards = Math.hypot(...toCentre) > 0 ? unit(toCentre) : [0, 0, 1];
  return placed(along(times(offset, light.radius), [...acrossAxes(towards), towards]));
}

// For how much of the radius of a soft light sample k stands.
const lightPart = (k) => 1 / Math.sqrt(4 * Math.floor((k + 1) / 2) + 1);

// Which way the width and the height of a rectangle lie that faces a unit direction.
function levelAxes(direction) {
  const [x, , z] = direction, across = unit(Math.hypot(x, z) > UPRIGHT ? [z, 0, -x] : [1, 0, 0]);
  return [across, cross(direction, across)];
}

// Two unit vectors at right angles to a unit direction and to each other. Turns leave nothing exactly along an axis.
function acrossAxes(direction) {
  const sizes = direction.map((x) => Math.round(1e9 * Math.abs(x))), least = sizes.indexOf(Math.min(...sizes));
  const x = unit(cross(direction, [0, 1, 2].map((k) => (k === least ? 1 : 0))));
  return [x, unit(cross(direction, x))];
}
