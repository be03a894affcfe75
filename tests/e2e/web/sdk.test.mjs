// clients/js in a browser: its own WebSocket, its own streams. What it does in node, e2e.js_client tests.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { Daemon } from './daemon.mjs';

const { build } = createRequire(new URL('../../../clients/web/package.json', import.meta.url))('esbuild');
const daemon = new Daemon('cornell', null, ['--deterministic']);
let context;

before(async () => {
    await daemon.start();
    context = await launch();
});

after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

test('a page edits, and sees the picture of it in bytes and in cd/m2', async () => {
    const entry = fileURLToPath(new URL('../../../clients/js/src/index.ts', import.meta.url));
    const { outputFiles } = await build({ entryPoints: [entry], bundle: true, write: false, format: 'iife', globalName: 'lumend', logLevel: 'warning' });
    const page = await context.newPage();
    await page.goto(`http://127.0.0.1:${daemon.port}/healthz`); // of the address that the server lets in
    const script = `(async () => {
        ${outputFiles[0].text}
        const session = await lumend.connect(${JSON.stringify(daemon.url)});
        const rev = await session.edit((edit) => edit.set('globe', { on: false }));
        const view = await session.view(48, 36, { linear: true, method: 'path', spp: 4 });
        const picture = await view.picture();
        const { value } = await view.read(24, 30);
        const small = await (await session.view(16, 12, { spp: 1 })).picture();
        const bitmap = await createImageBitmap(new Blob([await small.png()]));
        await session.close();
        return { rev, sceneRev: picture.sceneRev, ratio: picture.luminance()[48 * 30 + 24] / value, size: [bitmap.width, bitmap.height] };
    })()`;
    const { rev, sceneRev, ratio, size } = await page.evaluate(script);
    assert.equal(sceneRev, rev);
    assert.ok(Math.abs(ratio - 1) < 2 ** -10, 'half floats have 11 bits');
    assert.deepEqual(size, [16, 12]);
});
