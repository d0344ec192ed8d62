// Prints what gltf-validator says of each file that is named, as JSON.
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

async function issues(file) {
  const beside = (uri) => fs.promises.readFile(path.join(path.dirname(file), decodeURIComponent(uri)));
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    maxIssues: 0,
    externalResourceFunction: async (uri) => new Uint8Array(await beside(uri)),
  });
  return report.issues.messages.map(({ severity, code, message, pointer }) => ({ severity, code, message, pointer }));
}

Promise.all(process.argv.slice(2).map(issues)).then((found) => console.log(JSON.stringify(found)));
