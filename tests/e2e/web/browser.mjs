// Chromium, and what the tests read from a page: pixels, messages, numbers.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { mkdtempSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const { chromium } = createRequire(new URL('../../../clients/web/package.json', import.meta.url))('playwright-core');

export const CHROMIUM = '/usr/bin/chromium';
const FLAGS =
    '--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking --disable-component-update --disable-sync';

/** In a window of 1000 x 640 a page lays itself out the same whatever the scale; at 0.4 it has a sixth of the pixels to draw, and two
 * fifths of the picture's to render. People look at what is saved of it. */
const SCALE = process.env.LUMEND_SHOT || process.env.LUMEND_SHOTS ? 1 : 0.4;

export function launch(deviceScaleFactor = SCALE) {
    return chromium.launchPersistentContext(mkdtempSync(join(tmpdir(), 'lumend-chromium-')), {
        executablePath: CHROMIUM,
        headless: true,
        ignoreHTTPSErrors: true, // certificates of tests are signed by nobody whom it knows
        viewport: { width: 1000, height: 640 },
        deviceScaleFactor,
        args: FLAGS.split(' '),
    });
}

/** A hang must not hang the suite; what is slow on a loaded machine is no failure. */
const WAIT_MS = 120000;

/** From here on camera_seq is of the reference and of pictures to save (clients/web/src/state/camera_seq.ts). */
const OTHER_VIEWS = 2 ** 30;

/** A page that remembers its errors, what it sent, its last sent and received camera_seq, and the statistics of its frames. */
export async function open(context, url, onText = () => undefined) {
    const page = await context.newPage();
    page.setDefaultTimeout(WAIT_MS);
    const watch = { errors: [], sent: [], sentSeq: 0, shownSeq: 0, stats: [] };
    page.on('pageerror', (e) => watch.errors.push(e.message));
    page.on('console', (m) => m.type() === 'error' && watch.errors.push(m.text()));
    // A page that loads anew counts its cameras anew: what the last one sent is nothing to wait for.
    page.on('request', (r) => {
        if (r.isNavigationRequest() && r.frame() === page.mainFrame()) watch.sentSeq = watch.shownSeq = 0;
    });
    page.on('websocket', (socket) => {
        socket.on('framesent', ({ payload }) => {
            watch.sent.push(JSON.parse(String(payload)));
            const seq = /"camera_seq":(\d+)/.exec(String(payload));
            if (seq && Number(seq[1]) < OTHER_VIEWS) watch.sentSeq = Number(seq[1]);
        });
        socket.on('framereceived', ({ payload }) => {
            if (Buffer.isBuffer(payload) && payload.length >= 64 && payload.readUInt32LE(36) < OTHER_VIEWS) watch.shownSeq = payload.readUInt32LE(36);
            if (!Buffer.isBuffer(payload)) onText(payload);
            if (String(payload).startsWith('{') && String(payload).includes('"frame.stats"')) watch.stats.push(JSON.parse(payload).params);
        });
    });
    await page.goto(url);
    return { page, watch };
}

/** Waits until the newest change of the view and revision `rev` are on screen, with `spp` samples per pixel. */
export async function settled({ page, watch }, { spp = 2, rev = 0 } = {}) {
    // What the page decided to send in this frame has left it two frames later.
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    await page.waitForFunction(
        ([wantedSpp, wantedRev, wantedCamera]) => {
            const { rev: shown = -1, camera = -1 } = document.querySelector('.picture').dataset;
            const samples = Number((document.querySelector('.quality b')?.textContent ?? '').replace(/\D/g, ''));
            const enough = document.querySelector('.is-converged') !== null || samples >= wantedSpp;
            return Number(shown) >= wantedRev && Number(camera) >= wantedCamera && enough;
        },
        [spp, rev, watch.sentSeq],
    );
}

export async function shownRev(page) {
    return Number(await page.locator('.picture').getAttribute('data-rev'));
}

/** Mean linear luminance of a part of the picture (fractions), and how many different colours it has. */
export function measure(page, [x0, y0, x1, y1] = [0, 0, 1, 1]) {
    return page.evaluate(
        ([left, top, right, bottom]) => {
            const canvas = document.querySelector('.picture');
            const w = Math.max(1, Math.round((right - left) * canvas.width));
            const h = Math.max(1, Math.round((bottom - top) * canvas.height));
            const { data } = canvas
                .getContext('2d')
                .getImageData(Math.round(left * canvas.width), Math.round(top * canvas.height), w, h);
            const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
            const colours = new Set();
            let sum = 0;
            for (let i = 0; i < data.length; i += 4) {
                sum += 0.2126 * linear(data[i] / 255) + 0.7152 * linear(data[i + 1] / 255) + 0.0722 * linear(data[i + 2] / 255);
                colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
            }
            return { mean: sum / (data.length / 4), colours: colours.size };
        },
        [x0, y0, x1, y1],
    );
}

/** A small copy of the picture, to compare two of them. */
export function thumbnail(page) {
    return page.evaluate(() => {
        const small = document.createElement('canvas');
        small.width = 64;
        small.height = 48;
        const context = small.getContext('2d');
        context.drawImage(document.querySelector('.picture'), 0, 0, 64, 48);
        return [...context.getImageData(0, 0, 64, 48).data];
    });
}

/** Root mean square difference, 0..255. */
export function difference(a, b) {
    return Math.sqrt(a.reduce((sum, v, i) => sum + (v - b[i]) ** 2, 0) / a.length);
}

/** Centre of an element in window pixels. */
export async function centre(locator) {
    const box = await locator.boundingBox();
    return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

export async function drag(page, from, to, steps = 8) {
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await page.mouse.move(to.x, to.y, { steps });
    await page.mouse.up();
}

/** A lamp's line. Names are shown without their model's; whole they are in the title. */
export const row = (page, id) => page.locator('.light', { has: page.locator(`.light-name[title="${id}"]`) });
export const field = (page, id, label) => row(page, id).getByLabel(label, { exact: true });

export async function select(page, id) {
    const name = row(page, id).locator('.light-name');
    if ((await name.getAttribute('aria-expanded')) !== 'true') await name.click();
}

export async function eventually(condition, message) {
    const end = Date.now() + WAIT_MS;
    while (!(await condition())) {
        if (Date.now() > end) assert.fail(await message());
        await new Promise((resolve) => setTimeout(resolve, 50));
    }
}
