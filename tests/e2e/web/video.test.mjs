// A line too thin for tiles: pictures that move come as video, the status says so, and the one at rest is exact; a chunk that is
// broken is mended by a key. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { centre, difference, eventually, launch, measure, open, settled, thumbnail } from './browser.mjs';
import { Daemon } from './daemon.mjs';
import { Line } from './line.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
const THIN = 12_000; // bytes a second: WebP of 50 of 160 000 pixels takes more than a tenth of a second

const line = new Line();
let daemon, context, tab, page, video;

before(async () => {
    daemon = new Daemon(ROOM);
    await daemon.start();
    await line.start(daemon.port);
    context = await launch();
    // Chunks pass through here, so that one can be broken; the page notes what it is told.
    await context.addInitScript(() => {
        const Real = globalThis.VideoDecoder;
        globalThis.seen = { chunks: [], frames: 0, errors: 0, breakNext: false };
        if (!Real) return;
        globalThis.VideoDecoder = class extends Real {
            constructor({ output, error }) {
                super({ output: (f) => (globalThis.seen.frames++, output(f)), error: (e) => (globalThis.seen.errors++, error(e)) });
            }
            decode(chunk) {
                const { seen } = globalThis;
                seen.chunks.push(chunk.type);
                if (!seen.breakNext || chunk.type === 'key') return super.decode(chunk);
                seen.breakNext = false;
                const data = new Uint8Array(chunk.byteLength).fill(255);
                super.decode(new EncodedVideoChunk({ type: chunk.type, timestamp: chunk.timestamp, data }));
            }
        };
    });
    tab = await open(context, daemon.url.replace(`:${daemon.port}`, `:${line.port}`));
    page = tab.page;
    await page.getByLabel('Resolution').selectOption('fast');
    await page.getByLabel('Method').selectOption('whitted'); // one pass: a picture at rest stays as it is
    await settled(tab);
    video = /^with VP9$/m.test(String(execFileSync(process.env.LUMEND, ['--version'])));
    assert.equal(await page.evaluate(() => typeof VideoDecoder), 'function', 'Chromium has WebCodecs');
});

after(async () => {
    await context?.close();
    await line.close();
    assert.equal(await daemon.stop(), 0, daemon.log);
});

const codec = () => page.locator('.item-codec .item-value').textContent();
const seen = () => page.evaluate(() => globalThis.seen);

/** Turns the eye to and fro until it is so. */
async function dragUntil(condition, what) {
    const { x, y } = await centre(page.locator('.stage'));
    await page.mouse.move(x, y);
    await page.mouse.down();
    let n = 0;
    await eventually(
        async () => {
            await page.mouse.move(x + 60 * Math.sin(++n / 3), y);
            return condition();
        },
        async () => `${what}: never; ${await codec()}, ${JSON.stringify(await seen())}`,
    );
    await page.mouse.up();
}

const isVideo = async () => /^vp9 \d+$/.test(await codec());
const inVideo = (n) => async () => (await isVideo()) && (await seen()).frames >= n;

/** The newest frame is exact, and on the canvas. */
async function rests() {
    line.bytesPerSecond = Infinity;
    await settled(tab);
    await eventually(
        async () => {
            const newest = tab.watch.stats.at(-1);
            return newest.converged && newest.quality === 100 && Number(await page.locator('.picture').getAttribute('data-frame')) === newest.frame_seq;
        },
        async () => `never exact: ${JSON.stringify(tab.watch.stats.at(-1))}`,
    );
}

test('over a line too thin for tiles pictures that move are video, and the one at rest is exact', async (t) => {
    if (!video) return t.skip('this build has no VP9');
    assert.equal((await seen()).chunks.length, 0, 'a wide line has none');
    line.bytesPerSecond = THIN;
    await dragUntil(inVideo(4), 'video');
    const { chunks, frames } = await seen();
    assert.equal(chunks[0], 'key');
    assert.ok(chunks.filter((c) => c === 'key').length < chunks.length / 2, chunks.join(' '));
    // Each chunk is shown when it comes: none waits for the next.
    await eventually(async () => (await seen()).frames === (await seen()).chunks.length, async () => JSON.stringify(await seen()));
    assert.ok(frames >= 4);
    // Of the same eye as video, and exact. The exact one takes the line for seconds: what is shown before is the video.
    await eventually(async () => Number(await page.locator('.picture').getAttribute('data-camera')) === tab.watch.sentSeq, () => 'the eye came to no rest');
    const moving = { ...(await measure(page)), picture: await thumbnail(page) };
    const wasVideo = await isVideo();
    await rests();
    assert.match(await codec(), /^(webp|png) 100$/);
    const exact = { ...(await measure(page)), picture: await thumbnail(page) };
    t.diagnostic(`video ${wasVideo}: ${moving.mean} of ${exact.mean}, off by ${difference(moving.picture, exact.picture)}`);
    assert.ok(Math.abs(moving.mean / exact.mean - 1) < 0.03, `as bright in motion, ${moving.mean}, as at rest, ${exact.mean}`);
    assert.ok(difference(moving.picture, exact.picture) < 8);
    assert.deepEqual(tab.watch.errors, []);
});

test('a chunk that is broken is refused, and a key mends it', async (t) => {
    if (!video) return t.skip('this build has no VP9');
    line.bytesPerSecond = THIN;
    await dragUntil(inVideo((await seen()).frames + 3), 'video');
    const before = await seen();
    await page.evaluate(() => (globalThis.seen.breakNext = true));
    await dragUntil(async () => {
        const now = await seen();
        return now.errors > before.errors && now.chunks.slice(before.chunks.length).includes('key') && now.frames > before.frames + 2;
    }, 'mended');
    assert.equal((await seen()).errors, before.errors + 1);
    assert.ok(tab.watch.sent.some((m) => m.method === 'view.update' && m.params.resend === true));
    assert.ok(await isVideo());
    await rests();
    assert.deepEqual(tab.watch.errors, []);
});
