// Pictures as files: what is on screen, and all around from where its camera stands. Scene: room.jsonl, seen from its middle.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { page, roomOps, sceneFile, serve, tab, violations } from './stage.mjs';

const inside = ['position', 'target'].map((path, i) => JSON.stringify({ op: 'set', id: 'main', path: `/${path}`, value: [[0, 2, 1], [0, 2, 0]][i] }));
serve(sceneFile([...roomOps(), ...inside]), null);

const folder = mkdtempSync(join(tmpdir(), 'lumend-e2e-'));
const button = (name) => page.getByRole('group', { name: 'Save the picture' }).getByRole('button', { name });

/** What a button saves, as soon as there is something to save. */
async function save(name, format, early) {
    await page.getByLabel('Save as').selectOption(format);
    await page.getByLabel('Panorama’s size').selectOption('1024');
    const coming = page.waitForEvent('download', { timeout: 300000 });
    await button(name).focus();
    await page.keyboard.press('Enter');
    if (early) await button('Save it as it is').click({ timeout: 300000 }); // it is disabled until the first whole picture
    const download = await coming;
    const file = join(folder, download.suggestedFilename());
    await download.saveAs(file);
    return file;
}

/** Mean R, G, B of a PNG file around places, as shares of its size. */
const colours = (file, places) =>
    page.evaluate(
        async ([text, at]) => {
            const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
            const bitmap = await createImageBitmap(new Blob([bytes]));
            const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
            const context = canvas.getContext('2d');
            context.drawImage(bitmap, 0, 0);
            return at.map(([x, y]) => {
                const { data } = context.getImageData(Math.round(x * bitmap.width) - 8, Math.round(y * bitmap.height) - 8, 16, 16);
                return [0, 1, 2].map((k) => data.reduce((sum, v, i) => sum + (i % 4 === k ? v : 0), 0) / 256);
            });
        },
        [readFileSync(file).toString('base64'), places],
    );

const sizeOf = (png) => [readFileSync(png).readUInt32BE(16), readFileSync(png).readUInt32BE(20)];

/** Width and height of an EXR file. */
function windowOf(exr) {
    const bytes = readFileSync(exr);
    const at = bytes.indexOf('dataWindow\0box2i\0') + 17 + 4; // after its name, its type, and how long it is
    const [x0, y0, x1, y1] = [0, 4, 8, 12].map((i) => bytes.readInt32LE(at + i));
    return [x1 - x0 + 1, y1 - y0 + 1];
}

test('a panorama shows all around: what is at the left of the room is at its left, and above is up', async () => {
    const file = await save('Save panorama', 'png', true);
    assert.match(file, /panorama\.png$/);
    assert.deepEqual(sizeOf(file), [1024, 512]);
    const [left, right, lamp, floor] = await colours(file, [[0.25, 0.5], [0.75, 0.5], [0.5, 0.15], [0.5, 0.85]]);
    assert.ok(left[0] > 1.5 * left[2], `the red wall at the left: ${left}`);
    assert.ok(right[2] / right[0] > 1.5 * (left[2] / left[0]), `the blue wall, in warm light, at the right: ${right}, not ${left}`);
    assert.ok(lamp[1] > 1.3 * floor[1], `the lamp above: ${lamp}, the floor below: ${floor}`);
    await button('Save panorama').waitFor(); // it is done
});

test('the same as EXR is read by the daemon’s own tools', async () => {
    const file = await save('Save panorama', 'exr', true);
    assert.match(file, /panorama\.exr$/);
    const run = spawnSync(process.env.LUMEND, ['compare', file, file, '--metric', 'relmse']);
    assert.equal(run.status, 0, String(run.stderr));
});

test('the picture on screen is saved at once, and in cd/m2', async () => {
    const picture = page.locator('.picture');
    const file = await save('Save picture', 'png', false);
    assert.match(file, /picture\.png$/);
    assert.deepEqual(sizeOf(file), await picture.evaluate((c) => [c.width, c.height]));
    const exr = await save('Save picture', 'exr', true);
    assert.match(exr, /picture\.exr$/);
    const { rest_size: rest } = tab.watch.sent.filter((m) => m.params?.rest_size).at(-1).params;
    assert.deepEqual(windowOf(exr), rest, 'as fine as the picture at rest');
});

test('who does not want it any more calls it off, and the view on screen goes on', async () => {
    await button('Save panorama').focus();
    await page.keyboard.press('Enter');
    await button('Cancel').waitFor();
    for (let i = 0; !(await button('Cancel').evaluate((b) => b === document.activeElement)) && i < 200; i++) await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
    assert.deepEqual(await violations(page), []);
    const focused = () => page.evaluate(() => document.activeElement.textContent.trim());
    assert.equal(await focused(), 'Cancel');
    await page.keyboard.press('Enter');
    await button('Save panorama').waitFor();
    for (let i = 0; (await focused()) !== 'Save panorama' && i < 200; i++) await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
    assert.equal(await focused(), 'Save panorama');
    const closed = () => tab.watch.sent.filter((m) => m.method === 'view.close').length;
    for (let i = 0; closed() < 4 && i < 200; i++) await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
    assert.equal(closed(), 4, 'each view of its own was closed');
    assert.deepEqual(tab.watch.errors, []);
});
