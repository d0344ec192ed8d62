// A stub until the controls come.
async function startPage() {
  const data = JSON.parse(document.getElementById("data").textContent);
  data.shaders = document.getElementById("shaders").textContent;
  data.parts = document.getElementById("parts").textContent;
  const drawing = await createDrawing(document.querySelector("canvas"), data);
  let state = { ...START, ...data.start };
  const stage = data.stage, home = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
  const show = () => drawing.draw(
    { camera: data.camera, pose: pose(state, stage) },
    [light(state, stage, home, data.held), ...data.lights],
    { shading: state.shading, shadows: state.shadows },
  );
  show();
  window.pointshade = { drawing, data, show, get state() { return state; }, set state(value) { state = value; show(); } };
}
startPage().catch((error) => { console.error(error); window.pointshadeError = String(error); });
