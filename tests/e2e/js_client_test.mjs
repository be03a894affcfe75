// clients/js: sessions, edits, pictures and sensors of a running daemon; what is refused, and what breaks.
//     LUMEND=build/release/bin/lumend node tests/e2e/js_client_test.mjs
// Compiled with what clients/web has installed, ws among it: nothing is fetched.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { deflateSync, inflateSync } from 'node:zlib';
import { certificate } from './web/certificate.mjs';
import { Daemon } from './web/daemon.mjs';
import { Line } from './web/line.mjs';

const root = fileURLToPath(new URL('../..', import.meta.url));
const js = join(root, 'clients/js');
const ofWeb = createRequire(join(root, 'clients/web/package.json'));
const out = join(root, 'clients/web/node_modules/.cache/js');
const LAMP = 'ceiling-panel';

let lumend, inside, daemon, session;

before(async () => {
    rmSync(out, { recursive: true, force: true });
    await ofWeb('esbuild').build({
        entryPoints: ['src/index.ts', 'src/picture.ts', 'src/frame.ts', 'examples/first_picture.js', 'examples/even_light.js'].map((path) => join(js, path)),
        outdir: out,
        outbase: js,
        bundle: true,
        platform: 'node',
        format: 'esm',
        target: 'node18',
        alias: { lumend: join(js, 'src/index.ts') },
        outExtension: { '.js': '.mjs' },
        logLevel: 'warning',
    });
    const load = (name) => import(pathToFileURL(join(out, `src/${name}.mjs`)));
    lumend = await load('index');
    inside = { ...(await load('picture')), ...(await load('frame')) };
    daemon = new Daemon('cornell', null, ['--deterministic']);
    session = await lumend.connect(await daemon.start(), { client: 'test' });
});

after(async () => {
    await session.close();
    assert.equal(await daemon.stop(), 0);
});

const refused = (code) => (error) => error instanceof lumend.RpcError && error.app === code;

test('edits are made together or not at all, undone and redone, and others see them', async () => {
    const before = await session.scene();
    assert.equal(before.get(LAMP).type, 'light');
    assert.equal(before.get('render').type, 'render');
    const other = await lumend.connect(daemon.url);
    const told = new Promise((resolve) => other.on('scene.changed', resolve));
    const rev = await session.edit(
        (edit) => {
            edit.add('light', 'key', { kind: 'point', position: [0, 2, 0], flux_lm: 800 });
            edit.set('key', { cct_k: 3000, on: false });
            edit.setPart('key', '/position/1', 2.5);
        },
        { op_id: 'three-at-once' },
    );
    const { op_id: opId, user, scene_rev: heard } = await told;
    assert.deepEqual([opId, user, heard, session.sceneRev], ['three-at-once', session.name, rev, rev]);
    const now = (await other.scene()).get('key');
    assert.deepEqual([now.position, now.cct_k, now.on, now.flux_lm, other.sceneRev], [[0, 2.5, 0], 3000, false, 800, rev]);
    await other.close();
    await session.undo();
    assert.ok(!(await session.scene()).has('key'));
    await session.redo();
    await session.edit((edit) => edit.remove('key'));
    assert.deepEqual(await session.scene(), before);
    const repeated = await session.call('scene.apply', { ops: [{ op: 'remove', id: LAMP }], op_id: 'three-at-once', repeat: true });
    assert.deepEqual(repeated, { scene_rev: rev, repeated: true });
    assert.ok((await session.scene()).has(LAMP));
    assert.equal((await session.ops()).find((op) => op.id === LAMP).op, 'add');
});

test('what is refused says why', async () => {
    const wrong = session.edit((edit) => edit.set(LAMP, { flux_lm: -1 }));
    await assert.rejects(wrong, (error) => refused('invalid_value')(error) && /flux_lm/.test(error.path));
    await assert.rejects(session.sensor('desk'), refused('not_found'));
    await assert.rejects(session.view(0, 4), refused('invalid_value'));
    await assert.rejects(session.apply([{ op: 'remove', id: 'nobody' }]), refused('not_found'));
    await assert.rejects(lumend.connect(daemon.url.replace(/t=.*/, 't=wrong')), (error) => error instanceof lumend.RpcError || /token/.test(error.message));
});

test('pictures show edits, in bytes and in cd/m2', async () => {
    const view = await session.view(96, 72, { linear: true, method: 'path', spp: 4 });
    const lit = await view.picture();
    assert.deepEqual([lit.converged, lit.linear, lit.stats.spp, lit.stats.method], [true, true, 4, 'path']);
    const { value, unit } = await view.read(48, 60);
    assert.equal(unit, 'cd/m2');
    assert.ok(Math.abs(lit.luminance()[96 * 60 + 48] / value - 1) < 2 ** -10, 'half floats have 11 bits');
    const rev = await session.edit((edit) => [LAMP, 'globe'].forEach((lamp) => edit.set(lamp, { on: false })));
    const dark = await view.picture();
    assert.deepEqual([Math.max(...dark.luminance()), dark.sceneRev], [0, rev]);
    await session.undo();
    assert.deepEqual((await view.picture()).radiance(), lit.radiance());
    assert.equal((await view.pick(48, 70)).id, 'floor');
    await view.update({ camera: { position: [0, 2, 7.4], target: [0, 2, 17] } }); // looks away from the room
    assert.equal(Math.max(...(await view.picture()).luminance()), 0);
    await assert.rejects(lit.png(), TypeError);
    const file = Buffer.from(await lit.exr());
    assert.deepEqual(planesOf(file, 96, 72), lit.radiance());
    writeFileSync(join(out, 'lit.exr'), file);
    const same = spawnSync(process.env.LUMEND, ['compare', join(out, 'lit.exr'), join(out, 'lit.exr'), '--metric', 'relmse']);
    assert.equal(same.status, 0, `the daemon's own reader takes it: ${same.stderr}`);
    await view.close();

    const small = await session.view(64, 48, { spp: 1 });
    const picture = await small.picture(false);
    assert.deepEqual([picture.width, picture.height, picture.linear], [64, 48, false]);
    const png = Buffer.from(await picture.png());
    assert.deepEqual([png.toString('latin1', 12, 16), png.readUInt32BE(16), png.readUInt32BE(20)], ['IHDR', 64, 48]);
    const rows = inflateSync(png.subarray(png.indexOf('IDAT') + 4, -16));
    assert.deepEqual([...rows.subarray(-4)], [...picture.rgba().slice(-4)]);
    assert.throws(() => picture.exr(), TypeError);
    await small.close();
});

/** R G B of each pixel of an EXR file of half floats in ZIP blocks of 16 rows. */
function planesOf(file, width, height) {
    const blocks = Math.ceil(height / 16), table = file.indexOf('whiteLuminance') + 30; // its name, type, length, value; the header's end
    const rgb = new Float32Array(3 * width * height);
    for (let b = 0; b < blocks; b++) {
        const at = Number(file.readBigUInt64LE(table + 8 * b)), rows = Math.min(16, height - 16 * b), bytes = 6 * width * rows;
        assert.equal(file.readInt32LE(at), 16 * b);
        let block = file.subarray(at + 8, at + 8 + file.readInt32LE(at + 4));
        if (block.length < bytes) {
            const sorted = inflateSync(block);
            for (let i = 1; i < bytes; i++) sorted[i] = sorted[i] + sorted[i - 1] - 128;
            block = Buffer.from(sorted.map((_, i) => sorted[(i & 1 ? (bytes + 1) >> 1 : 0) + (i >> 1)]));
        }
        for (let row = 0; row < rows; row++)
            for (let c = 0; c < 3; c++) for (let x = 0; x < width; x++) rgb[3 * (width * (16 * b + row) + x) + 2 - c] = halfAt(block, 2 * (width * (3 * row + c) + x));
    }
    return rgb;
}

function halfAt(bytes, at) {
    const bits = bytes.readUInt16LE(at), exponent = (bits >> 10) & 31, fraction = bits & 1023;
    return (bits & 0x8000 ? -1 : 1) * (exponent ? (1 + fraction / 1024) * 2 ** (exponent - 15) : fraction * 2 ** -24);
}

const HEADER = { magic: 'LUMF', flags: 1, frame: 1, x: 0, y: 0, w: 2, h: 2, fullW: 4, fullH: 2, codec: 0, downscale: 0 };

function message(fields, payload) {
    const h = { ...HEADER, ...fields };
    const pixels = payload ?? Buffer.alloc(4 * h.w * h.h, h.frame);
    const all = Buffer.alloc(64 + pixels.length);
    all.write(h.magic, 'latin1');
    all.set([1, 1, 64], 4);
    all.writeUInt32LE(h.flags, 8);
    all.writeUInt32LE(pixels.length, 12);
    all.writeBigUInt64LE(BigInt(h.frame), 16);
    [h.x, h.y, h.w, h.h, h.fullW, h.fullH].forEach((v, i) => all.writeUInt16LE(v, 40 + 2 * i));
    all.set([h.codec, 0, h.downscale], 52);
    all.set(pixels, 64);
    return all.buffer.slice(all.byteOffset, all.byteOffset + all.length);
}
const tile = async (fields, payload) => inside.readTile(inside.decodeFrame(message(fields, payload)));

test('tiles come together with the last of their frame', async () => {
    const canvas = new inside.Canvas();
    assert.ok(canvas.take(await tile({ w: 4 })));
    const whole = canvas.picture(null).rgba();
    assert.ok(!canvas.take(await tile({ flags: 0, frame: 2 })));
    assert.deepEqual(canvas.picture(null).rgba(), whole);
    assert.ok(canvas.take(await tile({ frame: 3, x: 2 }))); // 2 was cut off: nothing of it shows
    const row = [...Array(8).fill(1), ...Array(8).fill(3)];
    assert.deepEqual([...canvas.picture(null).rgba()], [...row, ...row]);
});

test('of tiles with fewer pixels each covers a square, but for what is beyond the edge', async () => {
    const canvas = new inside.Canvas();
    canvas.take(await tile({ w: 3, h: 3, fullW: 3, fullH: 3, downscale: 1 }, Buffer.from([0, 1, 2, 3].flatMap((v) => [v, v, v, v]))));
    const pixels = canvas.picture(null).rgba().filter((_, i) => i % 4 === 0);
    assert.deepEqual([...pixels], [0, 0, 1, 0, 0, 1, 2, 2, 3]);
});

test('half floats of all kinds are read', async () => {
    const canvas = new inside.Canvas();
    const halves = [0x3c00, 0xc000, 0x7bff, 0x3c00, 0x0001, 0x0400, 0x3555, 0x3c00]; // 1, -2, the largest; the least, the least normal, a third
    canvas.take(await tile({ codec: 4, w: 2, h: 1, fullW: 2, fullH: 1 }, deflateSync(Buffer.from(new Uint16Array(halves).buffer))));
    assert.deepEqual([...canvas.picture(null).radiance()], [1, -2, 65504, 2 ** -24, 2 ** -14, 1365 / 4096]);
});

test('tiles that do not fit are refused, and so is what unpacks to more than it says', async () => {
    const wrong = [[{ x: 3 }], [{}, Buffer.from('1234')], [{ codec: 1 }], [{ magic: 'LUMG' }], [{ downscale: 1 }], [{ codec: 4 }, Buffer.from('none')]];
    for (const [fields, payload] of [...wrong, [{ codec: 4, w: 1, h: 1 }, deflateSync(Buffer.alloc(1 << 24))]]) {
        await assert.rejects(tile(fields, payload), JSON.stringify(fields));
    }
});

test('sensors are measured, and the examples run', async () => {
    const run = (url, name, ...more) =>
        spawnSync(process.execPath, [join(out, `examples/${name}.mjs`), url, ...more], { encoding: 'utf8', env: { ...process.env, STEPS: '2', ENOUGH: '0.05' } });
    const empty = new Daemon(join(root, 'clients/python/examples/empty.jsonl'), null, ['--deterministic']);
    const url = await empty.start();
    const even = run(url, 'even_light');
    const [, first, last] = /Uo (\S+) before, (\S+) now/.exec(even.stdout) ?? assert.fail(even.stderr);
    assert.ok(Number(last) > Number(first), even.stdout);
    assert.match(run(url, 'even_light').stderr, /there are objects in this scene/);
    const picture = join(out, 'first.png');
    const { stdout, stderr } = run(url, 'first_picture', picture);
    assert.match(stdout, /4 samples per pixel/, stderr);
    assert.equal(readFileSync(picture).readUInt32BE(16), 600);

    const other = await lumend.connect(url);
    const exact = ({ em_lx: mean, em_stderr_lx: error }) => error < 0.02 * mean;
    const full = await other.sensor('work-plane', exact);
    const rev = await other.edit((edit) => [1, 2, 3, 4].forEach((i) => edit.set(`lamp-${i}`, { flux_lm: 250 })));
    const dim = await other.sensor('work-plane', exact);
    assert.equal(dim.scene_rev, rev);
    // Lamps of a tenth: 4 standard errors of the ratio of two means.
    const noise = 4 * Math.hypot(full.em_stderr_lx / full.em_lx, dim.em_stderr_lx / dim.em_lx);
    assert.ok(Math.abs((10 * dim.em_lx) / full.em_lx - 1) < noise + 1e-6);
    const probed = await other.call('probe', { point: [0, 0.75, 0], normal: [0, 1, 0], samples: 256 });
    assert.ok(probed.illuminance_lx > dim.emin_lx - 5 * probed.stderr_lx);
    await other.close();
    assert.equal(await empty.stop(), 0);
});

const made = certificate();
test('by TLS, where the certificate is trusted', { skip: !made && 'openssl is not installed' }, async () => {
    const secure = new Daemon('cornell', null, made.options);
    const url = await secure.start();
    const picture = join(out, 'secure.png');
    const run = (more) => spawnSync(process.execPath, [join(out, 'examples/first_picture.mjs'), url, picture], { encoding: 'utf8', env: { ...process.env, ...more } });
    assert.match(url, /^https:\/\/localhost:/);
    const { stdout, stderr } = run({ NODE_EXTRA_CA_CERTS: made.file });
    assert.match(stdout, /samples per pixel/, stderr);
    assert.match(run({}).stderr, /cannot connect/);
    assert.equal(await secure.stop(), 0);
});

test('a line that breaks is made again: edits are made once, views and listeners go on', async () => {
    const own = new Daemon('cornell', null, ['--deterministic']);
    await own.start();
    const line = new Line();
    await line.start(own.port);
    const across = await lumend.connect(own.url.replace(`:${own.port}`, `:${line.port}`), { client: 'roamer', reconnectMs: 120_000, timeoutMs: 120_000 });
    const beside = await lumend.connect(own.url, { client: 'beside' });
    const told = [];
    across.on('scene.changed', ({ scene_rev: rev }) => told.push(rev));
    const { name } = across;
    const view = await across.view(32, 24, { linear: true, method: 'path', spp: 2 });
    await view.picture();
    const first = view.id;

    // The server has it, and its answer is lost on the way.
    line.cut = { direction: 'down', before: true };
    const edited = across.edit((edit) => edit.set(LAMP, { flux_lm: 1234 }));
    await new Promise((gone) => line.server.once('cut', gone));
    const rev = await beside.edit((edit) => edit.set('globe', { on: false })); // while the other is away
    const asked = across.scene(); // waits for the line
    line.open = true;
    assert.equal(await edited, rev - 1, 'as it was made the first time, and once');
    assert.equal((await asked).get('globe').on, false);
    assert.equal(across.name, name);
    const picture = await view.picture();
    assert.ok(picture.sceneRev >= rev, 'the view was opened again');
    assert.deepEqual([picture.width, picture.height], [32, 24]);
    const ids = (await across.call('stats.get', {})).views.map((v) => v.view_id);
    assert.ok(ids.includes(view.id), `view ${view.id}, which was ${first}, of ${ids}`);
    assert.deepEqual(told.filter((r) => r === rev || r === rev - 1), [rev - 1, rev], 'what was missed was told, once');
    assert.equal(await across.undo(), rev + 1);
    assert.equal((await across.scene()).get(LAMP).flux_lm === 1234, false);

    const gone = async () => {
        line.break();
        while (!across.away) await new Promise(setImmediate);
    };
    // Of a view that is asked while the line is away the number is that of the new connection: another one, as the first is closed.
    const second = await across.view(16, 12, { linear: true, method: 'path', spp: 1 });
    await view.close();
    await gone();
    const moved = second.update({ size: [24, 12], effects: { media: 'off' } });
    const read = second.read(2, 2);
    line.open = true;
    await moved;
    assert.ok('value' in (await read), 'that of this view, whatever it has by now');
    assert.equal((await second.picture()).width, 24);

    // Whichever of the two cameras came last counts when it is opened again, and effects add up.
    await second.update({ camera_id: 'main', effects: { soft_shadow: 'off' } });
    await second.update({ camera: { position: [0, 1, 0.5], target: [0, 1, 0] } });
    assert.deepEqual(second.renewed().effects, { media: 'off', soft_shadow: 'off' });
    await gone();
    line.open = true;
    assert.equal((await second.picture()).width, 24);
    await assert.rejects(second.update({ method: 'none such' }), refused('invalid_value'));
    await gone();
    const closing = second.close();
    line.open = true;
    await closing;
    assert.deepEqual((await across.call('stats.get', {})).views, [], 'what was closed while the line was away is closed');

    // Nobody is there any more.
    const roam = () => lumend.connect(own.url.replace(`:${own.port}`, `:${line.port}`), { reconnectMs: 300 });
    const short = await roam();
    line.break();
    await assert.rejects(short.wait(() => null, 'it', () => null), lumend.ClosedError);
    await assert.rejects(short.scene(), lumend.ClosedError);
    line.open = true;
    assert.equal(await across.redo(), across.sceneRev);

    // Closed while the line is away: it is not tried any more.
    let tries = 0;
    await gone();
    line.server.on('connection', () => tries++);
    await across.close();
    await assert.rejects(across.scene(), lumend.ClosedError);
    line.open = true;
    await beside.scene();
    assert.equal(tries, 0);
    for (const session of [beside, short]) await session.close();
    await line.close();
    assert.equal(await own.stop(), 0, own.log);
});

/** A server that answers as a test wants it to, by the sockets that are opened to it, in their order. */
async function scripted(t, options, ...scripts) {
    const { WebSocketServer } = ofWeb('ws');
    const server = new WebSocketServer({ host: '127.0.0.1', port: 0, handleProtocols: () => 'lumend.v1' });
    await new Promise((ready) => server.once('listening', ready));
    t.after(() => server.close());
    const lines = [];
    server.on('connection', (socket, request) => {
        assert.equal(request.url, '/atrium/'); // a proxy knows by the path whom it is for
        const script = scripts[Math.min(lines.length, scripts.length - 1)];
        lines.push(socket);
        socket.seen = [];
        socket.on('message', (text) => {
            const { id, method, params } = JSON.parse(text);
            socket.seen.push({ method, params });
            const answer = script(method, params, socket);
            if (answer?.error) socket.send(JSON.stringify({ jsonrpc: '2.0', id, error: { code: -32000, message: answer.error, data: { code: answer.error } } }));
            else if (answer) socket.send(JSON.stringify({ jsonrpc: '2.0', id, result: answer }));
        });
    });
    const session = await lumend.connect(`http://127.0.0.1:${server.address().port}/atrium/#t=x`, { reconnectMs: 60_000, timeoutMs: 60_000, ...options });
    return { session, lines };
}
const greeting = (resumed, more = {}) => ({ session: 'a.0-1', key: 'k', resumed, limits: { message_bytes: 1000 }, scene_rev: 5, project: null, ...more });

test('an edit whose session was lost on the way is not made again, whatever hello came last', async (t) => {
    const { session, lines } = await scripted(
        t,
        {},
        (method, _, socket) => (method === 'session.hello' ? greeting(false) : method === 'view.open' ? { view_id: 1 } : void socket.terminate()),
        (method, _, socket) => (method === 'session.hello' ? greeting(false) : void socket.terminate()), // as its view is opened again
        (method) => (method === 'session.hello' ? greeting(true) : method === 'view.open' ? { view_id: 1 } : { scene_rev: 6 }),
    );
    await session.view(4, 3);
    await assert.rejects(session.undo(), (error) => error instanceof lumend.ClosedError && /does not know this session/.test(error.message));
    assert.equal(await session.undo(), 6, 'the next is of the session there is');
    await session.close();
    assert.equal(lines.length, 3);
    assert.ok(lines.every(({ seen }) => !seen.some(({ params }) => params?.repeat)));
});

test('what a server refuses for the moment, or of one view, ends no session; a message that is too long is not sent', async (t) => {
    const first = (method, _, socket) => {
        if (method === 'session.hello') return greeting(false);
        if (method === 'view.open') return { view_id: 1 };
        return void socket.terminate();
    };
    const { session, lines } = await scripted(
        t,
        {},
        first,
        () => ({ error: 'limit_exceeded' }),
        (method) => (method === 'session.hello' ? greeting(true) : method === 'view.open' ? { error: 'not_found' } : { scene_rev: 9 }),
    );
    await assert.rejects(session.edit((edit) => edit.set('a', { name: 'x'.repeat(1000) })), RangeError);
    await assert.rejects(session.edit((edit) => edit.set('a', { name: 'ä'.repeat(490) })), RangeError);
    const view = await session.view(4, 3);
    assert.equal(await session.undo(), 9, 'made when the line was there again');
    await assert.rejects(view.picture(), refused('not_found'));
    await view.close();
    await session.close();
    assert.deepEqual(lines.map(({ seen }) => seen.map(({ method }) => method)), [
        ['session.hello', 'view.open', 'scene.undo'],
        ['session.hello'],
        ['session.hello', 'view.open', 'scene.undo'],
    ]);
});

test('the end of a connection that is not the newest is no news, and one that is refused for good ends the session', async (t) => {
    const { session, lines } = await scripted(
        t,
        {},
        (method, _, socket) => (method === 'session.hello' ? greeting(false) : void socket.terminate()),
        () => ({ error: 'limit_exceeded' }),
        (method) => (method === 'session.hello' ? greeting(true) : { ops: [] }),
    );
    assert.equal((await session.scene()).size, 0);
    lines[1].close(4009);
    await new Promise((gone) => (lines[1].readyState === 3 ? gone() : lines[1].once('close', gone)));
    assert.equal((await session.scene()).size, 0);
    lines[2].close(1009);
    await assert.rejects(session.wait(() => null, 'end', () => null), lumend.ClosedError);
    await session.close();
    assert.equal(lines.length, 3);
});

test('a server that stops, or is none, is told', async () => {
    const short = new Daemon('cornell', null);
    const cut = await lumend.connect(await short.start(), { timeoutMs: 30_000 });
    await assert.rejects(cut.wait(() => null, 'it did not come', () => null, 1), /it did not come within 0.001 s/);
    const view = await cut.view(64, 48, { spp: 1 });
    await view.picture();
    assert.equal(await short.stop(), 0);
    await assert.rejects(cut.wait(() => null, 'nothing', () => null), lumend.ClosedError);
    await assert.rejects(cut.scene(), lumend.ClosedError);
    await cut.close();
    await assert.rejects(lumend.connect(short.url), /does lumend run there/);
    await assert.rejects(lumend.connect('no address'), TypeError);
    await assert.rejects(lumend.connect('ftp://127.0.0.1/'), /is not a URL of lumend/);
});

// ---- types ----

/** Requests, replies and notifications of PROTOCOL.md as values of their types. */
function examples() {
    const page = readFileSync(join(root, 'protocol/PROTOCOL.md'), 'utf8');
    const lines = ["import type { Answers, Notifications, Params } from './messages.js';"];
    const give = (type, value) => lines.push(`export const v${lines.length}: ${type} = ${JSON.stringify(value)};`);
    for (const [, block] of page.matchAll(/```json\n(.*?)```/gs)) {
        const asked = new Map();
        for (const [, arrow, text] of block.matchAll(/^([→←]) (.*)$/gm)) {
            const { id, method, params, result } = JSON.parse(text);
            if (arrow === '→') {
                asked.set(id, method);
                give(`Params['${method}']`, params ?? {});
            } else if (method === 'frame.stats') give("Partial<Notifications['frame.stats']>", params);
            else if (method) give(`Notifications['${method}']`, params);
            else if (result && asked.has(id)) give(`Answers['${asked.get(id)}']`, result);
        }
    }
    return lines;
}

const MISTAKES = [
    "edit.add('light', 'key', { kind: 'pont' })",
    "edit.add('light', 'key', { flux_lm: 800 })", // of no kind
    "edit.add('render', 'render', { spp: 4 })", // is always there
    "edit.set('key', { fluxlm: 800 })",
    "session.call('scene.gte', {})",
    "session.call('bounds', { ids: 'room' })",
    "session.view(4, 3, { spp: '64' })",
];

test('a project that is being opened is waited for, and a server that is silent is not', async (t) => {
    t.mock.timers.enable({ apis: ['setTimeout'] });
    const settle = async () => {
        for (let i = 0; i < 20; i++) await Promise.resolve();
    };
    const begin = () => {
        const socket = { sent: [], send: (text) => socket.sent.push(JSON.parse(text)), close: () => undefined };
        const hello = new lumend.Session(socket, 1000).hello({ project: 'abc' });
        const tell = async (message) => {
            socket.onmessage({ data: JSON.stringify({ jsonrpc: '2.0', ...message }) });
            await settle();
        };
        return { socket, hello, tell };
    };
    const opening = { method: 'project.opening', params: { project: 'abc', stage: 'opening', waited_s: 1 } };
    const slow = begin();
    for (let i = 0; i < 5; i++) {
        t.mock.timers.tick(900);
        await slow.tell(opening);
    }
    await slow.tell({ id: slow.socket.sent[0].id, result: { session: 'a.0-1', project: { id: 'abc', name: 'A' }, limits: { message_bytes: 8388608 }, scene_rev: 1 } });
    await slow.hello;
    const silent = begin();
    await silent.tell(opening);
    t.mock.timers.tick(1000);
    await assert.rejects(silent.hello, /no answer to session.hello/);
});

test('a session is of a project, by name or by the address', async () => {
    const many = new Daemon(null, null, ['--projects', mkdtempSync(join(tmpdir(), 'lumend-e2e-'))]);
    const lobby = await lumend.connect(await many.start());
    assert.equal(lobby.project, null);
    const { project } = await lobby.call('project.create', { name: 'Foyer' });
    await lobby.close();
    for (const [url, options] of [[many.url, { project }], [many.url.replace('/#', `/?project=${project}#`), {}]]) {
        const inside = await lumend.connect(url, options);
        assert.deepEqual(inside.project, { id: project, name: 'Foyer' });
        assert.ok((await inside.scene()).has('main'));
        await inside.close();
    }
    const host = await lumend.connect(many.url, { project: '' });
    const gone = [];
    for (const name of ['a', 'b', 'c']) gone.push((await host.call('project.create', { name })).project);
    for (const one of gone) await host.call('project.delete', { project: one });
    assert.deepEqual(await host.call('project.erase', { project: gone[0] }), { project: gone[0] });
    assert.deepEqual(await host.call('trash.empty', {}), { erased: 2 });
    await host.close();
    assert.equal(await many.stop(), 0);
});

test('types are those of the protocol: its examples fit them, mistakes do not', () => {
    const check = spawnSync('python3', ['-B', join(js, 'records_from_protocol.py'), '--check'], { encoding: 'utf8' });
    assert.equal(check.status, 0, check.stderr);
    const found = examples();
    assert.ok(found.length > 60, `${found.length} examples`);
    const folder = join(out, 'types');
    mkdirSync(folder, { recursive: true });
    writeFileSync(join(folder, 'examples.ts'), found.join('\n').replace("'./messages.js'", `'${js}/src/messages.js'`));
    const mistakes = MISTAKES.map((line) => `    // @ts-expect-error\n    void ${line};`).join('\n');
    writeFileSync(join(folder, 'mistakes.ts'), `import type { Edit, Session } from '${js}/src/index.js';\nexport function f(edit: Edit, session: Session): void {\n${mistakes}\n}\n`);
    const files = ['examples.ts', 'mistakes.ts'].map((name) => join(folder, name));
    const options = ['--noEmit', '--strict', '--noUncheckedIndexedAccess', '--target', 'ES2022', '--module', 'ESNext', '--moduleResolution', 'bundler', '--skipLibCheck'];
    const tsc = spawnSync(process.execPath, [ofWeb.resolve('typescript/bin/tsc'), ...options, '--lib', 'ES2022,DOM,DOM.Iterable', ...files], { encoding: 'utf8' });
    assert.equal(tsc.status, 0, tsc.stdout);
});
