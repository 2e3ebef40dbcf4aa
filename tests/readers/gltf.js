// Proves that the validator of Khronos has nothing to say of the GLB files: no error, no warning.

const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

async function main(folder) {
    const names = fs.readdirSync(folder).filter((name) => name.endsWith(".glb")).sort();
    if (names.length === 0) throw new Error(`no glb file in ${folder}`);
    for (const name of names) {
        const bytes = new Uint8Array(fs.readFileSync(path.join(folder, name)));
        const report = await validator.validateBytes(bytes);
        const { numErrors, numWarnings, messages } = report.issues;
        if (numErrors + numWarnings > 0) throw new Error(`${name}: ${JSON.stringify(messages[0])}`);
        const { totalTriangleCount, totalVertexCount } = report.info;
        console.log(`gltf-validator: ${name}: no errors, no warnings, ` +
            `${totalTriangleCount} triangles, ${totalVertexCount} points`);
    }
}

main(process.argv[2]).catch((error) => {
    console.error(`FAILED: ${error.message}`);
    process.exit(1);
});
