// A thin line and a browser that reads no video: pictures that move come as WebP, the status says so, and the one at rest is
// exact. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { centre, eventually, launch, open, settled } from './browser.mjs';
import { Daemon } from './daemon.mjs';
import { Line } from './line.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
const THIN = 60_000; // bytes a second: a JPEG of 160 000 pixels takes more than 60 ms

const line = new Line();
let daemon, context, tab, page, webp;

before(async () => {
    daemon = new Daemon(ROOM);
    await daemon.start();
    await line.start(daemon.port);
    context = await launch();
    await context.addInitScript(() => delete globalThis.VideoDecoder); // a browser without video: tiles alone
    tab = await open(context, daemon.url.replace(`:${daemon.port}`, `:${line.port}`));
    page = tab.page;
    await page.getByLabel('Resolution').selectOption('fast');
    await page.getByLabel('Method').selectOption('whitted'); // one pass: a picture at rest stays as it is
    await settled(tab);
    // What this build can: the first picture at rest is WebP where it has that.
    await eventually(async () => /^(webp|png) 100$/.test(await codec()), async () => `never exact: ${await codec()}`);
    webp = (await codec()).startsWith('webp');
});

after(async () => {
    await context?.close();
    await line.close();
    assert.equal(await daemon.stop(), 0, daemon.log);
});

const codec = () => page.locator('.item-codec .item-value').textContent();

/** Every pixel of the picture, as a number. */
const print = () =>
    page.evaluate(async () => {
        const { width, height } = document.querySelector('.picture');
        const { data } = document.querySelector('.picture').getContext('2d').getImageData(0, 0, width, height);
        const hash = new Uint8Array(await crypto.subtle.digest('SHA-256', data));
        return [width, height, ...hash].join(' ');
    });

/** The last frame of the picture has come so, and is on the canvas: the status is told before. */
async function restsAs(name) {
    const frame = () => page.locator('.picture').getAttribute('data-frame');
    const newest = () => tab.watch.stats.at(-1);
    await eventually(
        async () => newest().converged && newest().codec === name && Number(await frame()) === newest().frame_seq,
        async () => `frame ${await frame()} is shown; of the newest: ${JSON.stringify(newest())}`,
    );
    assert.equal(await codec(), `${name} 100`);
}

/** Turns the eye to and fro until the status says so. */
async function dragUntil(pattern) {
    const seen = new Set();
    const { x, y } = await centre(page.locator('.stage'));
    await page.mouse.move(x, y);
    await page.mouse.down();
    let n = 0;
    await eventually(
        async () => {
            await page.mouse.move(x + 60 * Math.sin(++n / 3), y);
            seen.add(await codec());
            return pattern.test(await codec());
        },
        () => `the status said ${[...seen].join('; ')}`,
    );
    await page.mouse.up();
    return seen;
}

test('over a thin line pictures that move are WebP, and at rest the picture is exact', async (t) => {
    if (!webp) return t.skip('this build has no WebP');
    await dragUntil(/^jpeg 85$/);
    line.bytesPerSecond = THIN;
    await dragUntil(/^webp (50|85)$/);
    assert.match(await page.locator('.item-line .item-value').textContent(), /^[\d.]+ [kMG]?bit\/s$/);
    line.bytesPerSecond = Infinity;
    await settled(tab);
    await restsAs('webp');
    const atRest = await print();
    await page.getByLabel('Stream').selectOption('png');
    await restsAs('png');
    assert.equal(await print(), atRest, 'WebP at rest has the pixels that PNG has');
    await page.getByLabel('Stream').selectOption('jpeg');
    await dragUntil(/^jpeg 85$/);
    assert.deepEqual(tab.watch.errors, []);
});
