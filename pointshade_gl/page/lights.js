// Lights as the shaders read them (scene/light.py). Positions and directions are in home axes.

const unit = (v) => times(v, 1 / Math.hypot(...v));

// Rows of 5 texels for each light, in the axes of a viewer with this pose. spans: see shadowViews.
function lightRows(lights, pose, spans) {
  const turn = transposed(rotation(pose)), place = translation(pose);
  const rows = new Float32Array(20 * Math.max(lights.length, 1));
  lights.forEach((light, k) => {
    const row = rows.subarray(20 * k, 20 * k + 20);
    if (light.position) row.set([...applied(turn, plus(light.position, times(place, -1))), 1]);
    else row.set([...applied(turn, unit(light.direction)), 0]);
    row.set(times(light.color, light.intensity), 4);
    row.set(light.attenuation, 8);
    if (light.position && light.direction) {
      row.set(applied(turn, unit(light.direction)), 12);
      row.set(light.cone.map((angle) => Math.cos(radians(angle))), 16);
    }
    row[15] = spans && spans[k] ? spans[k][0] : -1;
    row[18] = spans && spans[k] ? spans[k][1] : 0;
    row[19] = light.size ? 1 : 0;
  });
  return rows;
}

// The inverse of a rigid pose.
function inverted(pose) {
  const turn = transposed(rotation(pose)), place = times(applied(turn, translation(pose)), -1);
  return [...turn.map((row, k) => [...row, place[k]]), [0, 0, 0, 1]];
}
