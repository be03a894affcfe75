// From nothing to a report, as a lighting designer goes: a room, twelve luminaires, a work plane that passes, a page to print.
// Assets: tests/photometry.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { centre, drag, eventually, row, settled } from './browser.mjs';
import { numbers, page, sceneFile, serve, tab, violations } from './stage.mjs';

serve(sceneFile([]), fileURLToPath(new URL('../../photometry', import.meta.url)));

const form = () => page.getByRole('group', { name: 'A new room' });

test('a scene without objects offers a room; its form goes by keyboard, and axe finds nothing in it', async () => {
    await page.getByRole('button', { name: 'An empty room' }).press('Enter');
    await eventually(() => page.evaluate(() => document.activeElement?.closest('[aria-label="A new room"]') !== null), () => 'the form has no focus');
    assert.deepEqual(await violations(page), []);
    for (const size of ['5.4', '3.6']) {
        await page.keyboard.press('Control+a');
        await page.keyboard.type(size);
        await page.keyboard.press('Tab');
    }
    await form().getByRole('button', { name: 'Build it' }).press('Enter');
    await page.locator('.banner-empty', { hasText: 'The scene has no light' }).waitFor();
    assert.equal(await page.getByRole('button', { name: 'Empty room…' }).count(), 0, 'there is one');
});

test('in the room a drag turns the head, with Ctrl the eye orbits, and the wheel walks', async () => {
    await page.locator('.stage.is-room').waitFor();
    const c = await centre(page.locator('.stage'));
    const moved = async (act) => {
        const before = tab.watch.sent.length;
        await act();
        await settled(tab);
        const cameras = tab.watch.sent.slice(before).flatMap(({ method, params }) => (method === 'view.update' && params.camera ? [params.camera] : []));
        return cameras.at(-1);
    };
    const apart = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
    const start = await moved(() => page.locator('.stage').press('h'));
    const looked = await moved(() => drag(page, c, { x: c.x + 90, y: c.y + 30 }));
    assert.ok(apart(looked.position, start.position) < 1e-6 && apart(looked.target, start.target) > 0.1 * apart(start.target, start.position), 'the eye stays, and looks elsewhere');
    const walked = await moved(() => page.mouse.wheel(0, -120));
    const [step, way] = [walked.position.map((v, i) => v - looked.position[i]), looked.target.map((v, i) => v - looked.position[i])];
    const along = step.reduce((sum, v, i) => sum + v * way[i], 0) / Math.hypot(...step) / Math.hypot(...way);
    assert.ok(along > 0.9999 && Math.abs(apart(walked.target, walked.position) - apart(looked.target, looked.position)) < 1e-6, `it goes where it looks: ${along}`);
    await page.keyboard.down('Control');
    const orbited = await moved(() => drag(page, c, { x: c.x + 20, y: c.y }));
    await page.keyboard.up('Control');
    assert.ok(apart(orbited.target, walked.target) < 1e-6 && apart(orbited.position, walked.position) > 0.1 * apart(start.target, start.position), 'with Ctrl what is looked at stays');
    await moved(() => page.locator('.stage').press('h'));
});

test('one of the luminaires is hung from the list, and made into twelve', async () => {
    await page.getByLabel('Search luminaires by name or file').fill('linear');
    await page.getByRole('option', { name: /Langfeldleuchte/ }).click();
    await page.getByRole('button', { name: 'Hang under the ceiling' }).click();
    await row(page, 'linear').locator('.light-details').waitFor();
    assert.ok((await numbers('linear', 'Y'))[0] > 2.6, 'under the ceiling');
    const white = () => tab.watch.sent.filter((m) => m.method === 'view.update' && m.params.white_balance_k).map((m) => m.params.white_balance_k);
    await eventually(() => white().length > 0, () => 'the first lamp is not what the eye comes to');
    assert.ok(white()[0] > 3000 && white()[0] < 6504, `${white()[0]} K`);
    await page.getByRole('button', { name: 'Rows…' }).click();
    await page.getByRole('button', { name: 'Spread over the floor' }).click();
    await page.getByRole('switch', { name: 'Group linear on' }).waitFor();
    const lamps = await page.locator('.light-list .light-name').allInnerTexts();
    assert.deepEqual(lamps.filter((name) => name.startsWith('linear-')).slice(0, 3), ['linear-2', 'linear-3', 'linear-4'], 'lamp 2 is before lamp 10');
});

test('a work plane passes 500 lx and a uniformity of 0.6, and the report has it', async () => {
    await page.getByRole('button', { name: 'Add work plane' }).click();
    const plane = page.locator('.sensor');
    await eventually(async () => /meets 500[^]*meets 0\.6/.test(await plane.innerText()), () => plane.innerText());
    const [file] = await Promise.all([page.waitForEvent('download', { timeout: 600000 }), page.getByRole('button', { name: 'Report' }).click()]);
    const html = readFileSync(await file.path(), 'utf8');
    assert.match(html, /Langfeldleuchte[^]*<td class="n">12/);
    assert.equal(html.match(/data:image\/png/g).length, 2);
    assert.match(html, /19\.?\d* m<sup>2<\/sup>: \d+(\.\d+)? W\/m<sup>2<\/sup>, or \d/);
    assert.match(await plane.innerText(), /Power [\d,.]+ W, [\d.]+ W\/m² over 19\.?\d* m², [\d.]+ W\/m² for each 100 lx/);
});

test('modelling is a choice away, and who stands where the view is tells glare by lamps and by day', async () => {
    await page.getByRole('combobox', { name: 'Measures' }).selectOption('modelling');
    const plane = page.locator('.sensor', { hasText: 'Mean' });
    await eventually(async () => /Modelling\s+0\.\d+ ± 0\.\d+[^]*Modelling is (not )?within 0\.30 to 0\.60/.test(await plane.innerText()), () => plane.innerText());
    await page.getByRole('button', { name: 'Add observer' }).press('Enter');
    const eye = page.locator('.sensor', { hasText: 'observer' });
    await eventually(async () => /UGR\s+[\d–][^]*DGP\s+0\.\d+ ± 0\.\d+[^]*Glare by day: \w+/.test(await eye.innerText()), () => eye.innerText());
    await page.getByLabel('DGP wanted, at most').fill('0.35');
    await page.getByLabel('DGP wanted, at most').press('Enter');
    await eventually(async () => /DGP[^]*meets 0\.35/.test(await eye.innerText()), () => eye.innerText());
    assert.deepEqual(await violations(page), []);
    if (process.env.LUMEND_SHOT) await page.screenshot({ path: process.env.LUMEND_SHOT });
});

test('eyes all over the floor tell where it glares most, and the view goes there', async () => {
    await page.getByRole('button', { name: 'Add glare grid' }).press('Enter');
    const eyes = page.locator('.sensor', { hasText: 'Worst UGR' });
    await eventually(async () => /Worst UGR\s+[\d.]+ ± [\d.]+[^]*(meets|misses) 19[^]*Worst at x [-\d.]+, y 1\.2, z [^]*looking along[^]*\d+ of \d+ places/.test(await eyes.innerText()), () => eyes.innerText());
    await eventually(async () => (await page.locator('.sensor-points text').allTextContents()).some((t) => /^\d+\.\d$/.test(t)), () => page.locator('.sensor-points').textContent());
    if (process.env.LUMEND_SHOT) await page.screenshot({ path: `${process.env.LUMEND_SHOT}.glare.png` });
    await eyes.getByRole('button', { name: 'See it' }).press('Enter');
    const [, x, z] = /Worst at x ([-\d.]+), y 1\.2, z ([-\d.]+)/.exec(await eyes.innerText());
    await eventually(
        () => Promise.resolve(watchedEye(tab.watch.sent).some(([ex, ey, ez]) => Math.hypot(ex - x, ey - 1.2, ez - z) < 0.02)),
        () => JSON.stringify(watchedEye(tab.watch.sent).slice(-3)),
    );
    await eyes.getByLabel('UGR wanted, at most').fill('28');
    await eyes.getByLabel('UGR wanted, at most').press('Enter');
    await eventually(async () => /meets 28/.test(await eyes.innerText()), () => eyes.innerText());
    assert.deepEqual(await violations(page), []);
    await eyes.getByRole('combobox', { name: 'Measures' }).selectOption('cylindrical');
    const now = page.locator('.sensor', { has: page.locator('.light-name', { hasText: 'glare' }) });
    await eventually(async () => /Mean\s+[\d,]+/.test(await now.innerText()), () => now.innerText());
});

/** Where the cameras are that the page asked for. */
const watchedEye = (sent) => sent.map((m) => m.params?.camera?.position).filter(Boolean);

test('nothing was written to the console as an error', () => assert.deepEqual(tab.watch.errors, []));
