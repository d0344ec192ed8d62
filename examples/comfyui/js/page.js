// Below the node: the page of its first picture, whose light follows the mouse. ComfyUI sends .html as a file to save,
// so its text is put into the frame, which can reach nothing of ComfyUI.
import { app } from "../../scripts/app.js";
import { api } from "../../scripts/api.js";

function addPage(node) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  frame.style.cssText = "width: 100%; height: 100%; border: 0";
  const options = { serialize: false, hideOnZoom: false, getMinHeight: () => 300 };
  const widget = node.addDOMWidget("page_view", "iframe", frame, options);
  widget.serialize = false;
  return frame;
}

app.registerExtension({
  name: "pointshade.page",
  nodeCreated(node) {
    if (node.comfyClass !== "PointshadeRelight") return;
    const before = node.onExecuted;
    let frame = null;
    node.onExecuted = async function (output) {
      before?.apply(this, arguments);
      const saved = output?.pointshade_page?.[0];
      if (!saved) return;
      const reply = await api.fetchApi(`/view?${new URLSearchParams(saved)}`);
      if (!reply.ok) return;
      frame ??= addPage(node);
      frame.srcdoc = await reply.text();
    };
  },
});
