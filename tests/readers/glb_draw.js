// Has three.js in a headless Chromium draw GLB files: NAME.glb in FOLDER to NAME.DAMAGE.{rgba,png,json}.
//
//   node glb_draw.js FOLDER CHROMIUM
//
// Sound files are drawn as they are, one of them also damaged in every way that glb_picture.py must
// find. The page, the library and the files are served to this machine alone; the browser is ended
// with its process group.

const fs = require("fs");
const http = require("http");
const os = require("os");
const path = require("path");
const { spawn } = require("child_process");

const THREE = path.dirname(path.dirname(require.resolve("three")));
const PAGE = path.join(__dirname, "glb_scene.html");
const DAMAGED = "torus_regular";
// Done to the scene by the page, and to the file here.
const DAMAGES = ["facets", "turned", "metal", "holes", "no_normals"];
const PATIENCE_MS = 180_000;
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary" };

function jobs(folder) {
    const names = fs.readdirSync(folder).filter((name) => name.endsWith(".glb")).sort();
    if (names.length === 0) throw new Error(`no glb file in ${folder}`);
    const stems = names.map((name) => path.basename(name, ".glb"));
    const damaged = stems.includes(DAMAGED) ? DAMAGED : stems[0];
    const all = stems.map((stem) => [stem, "none"]).concat(DAMAGES.map((damage) => [damaged, damage]));
    return all.map(([stem, damage]) => ({ id: `${stem}.${damage}`, stem, damage }));
}

function bytes(folder, job) {
    const whole = fs.readFileSync(path.join(folder, `${job.stem}.glb`));
    return job.damage === "no_normals" ? withoutNormals(whole) : whole;
}

// The same file, whose primitives name no normals.
function withoutNormals(whole) {
    const length = whole.readUInt32LE(12);
    const tree = JSON.parse(whole.subarray(20, 20 + length));
    for (const mesh of tree.meshes) {
        for (const primitive of mesh.primitives) delete primitive.attributes.NORMAL;
    }
    const out = Buffer.from(whole);
    out.write(JSON.stringify(tree).padEnd(length), 20);
    return out;
}

function body(request) {
    return new Promise((take, fail) => {
        const parts = [];
        request.on("data", (part) => parts.push(part)).on("error", fail);
        request.on("end", () => take(Buffer.concat(parts)));
    });
}

function asked(folder, todo, address) {
    if (address === "/") return [".html", fs.readFileSync(PAGE)];
    if (address === "/jobs") return [".json", JSON.stringify(todo)];
    const job = todo.find(({ id }) => address === `/job/${id}.glb`);
    if (job) return [".glb", bytes(folder, job)];
    const file = path.join(THREE, path.normalize(address.replace("/three/", "/")));
    return address.startsWith("/three/") && fs.existsSync(file)
        ? [path.extname(file), fs.readFileSync(file)] : undefined;
}

// Serves until the page says that it has finished, and how.
function serve(folder, todo, finish) {
    const server = http.createServer(async (request, response) => {
        const [, kind, name] = request.url.split("/");
        if (request.method === "POST") {
            const sent = await body(request);
            if (kind === "done") fs.writeFileSync(path.join(folder, path.basename(name)), sent);
            response.end();
            if (kind === "finished") finish(sent.toString());
            return;
        }
        const found = asked(folder, todo, request.url);
        response.writeHead(found ? 200 : 404, { "Content-Type": TYPES[found?.[0]] ?? "text/plain" });
        response.end(found?.[1]);
    });
    return new Promise((take) => server.listen(0, "127.0.0.1", () => take(server)));
}

function browse(chromium, profile, port) {
    return spawn(chromium, [
        "--headless=new", "--no-sandbox", "--no-first-run", "--disable-dev-shm-usage",
        "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        `--user-data-dir=${profile}`, `http://127.0.0.1:${port}/`,
    ], { stdio: "ignore", detached: true });
}

async function main(folder, chromium) {
    const todo = jobs(folder);
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), "glb-"));
    let finish;
    const finished = new Promise((take) => { finish = take; });
    const server = await serve(folder, todo, finish);
    const browser = browse(chromium, profile, server.address().port);
    browser.on("error", (error) => finish(String(error)));
    browser.on("exit", (code) => finish(`the browser ended, exit code ${code}`));
    const late = setTimeout(() => finish(`not drawn in ${PATIENCE_MS / 1000} s`), PATIENCE_MS);
    const fault = await finished;
    clearTimeout(late);
    await end(browser);
    server.closeAllConnections();
    server.close();
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
    if (fault) throw new Error(fault);
}

// Ends the browser and the processes of its own group, and waits for it.
function end(browser) {
    if (browser.pid === undefined || browser.exitCode !== null) return Promise.resolve();
    const gone = new Promise((take) => browser.on("exit", take));
    process.kill(-browser.pid, "SIGKILL");
    return gone;
}

main(process.argv[2], process.argv[3]).catch((error) => {
    console.error(`FAILED: three.js: ${error.message}`);
    process.exit(1);
});
