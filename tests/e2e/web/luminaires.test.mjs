// Lamps with photometric files, as a designer works with them. Assets: tests/photometry.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { eventually, field, row, select } from './browser.mjs';
import { edit as editTo, numbers, page, sceneFile, serve, tab, violations } from './stage.mjs';

const quad = (id, size, transform) => [
    { op: 'add', type: 'mesh', id: `${id}-mesh`, shape: 'quad', size },
    { op: 'add', type: 'object', id, mesh: `${id}-mesh`, material: 'white', transform },
];
/** 4 x 3 m, 2.8 m high, seen from a corner. */
const SCENE = [
    { op: 'add', type: 'material', id: 'white', base_color: [0.7, 0.7, 0.7], specular: 0 },
    ...quad('floor', [4, 0, 3], {}),
    ...quad('ceiling', [4, 0, 3], { translate: [0, 2.8, 0], rotate_deg: [180, 0, 0] }),
    ...quad('wall', [4, 0, 2.8], { translate: [0, 1.4, -1.5], rotate_deg: [90, 0, 0] }),
    { op: 'add', type: 'light', id: 'even', kind: 'environment', luminance_cd_m2: 10 },
    { op: 'add', type: 'light', id: 'hung', kind: 'ies', asset: 'downlight.ies', position: [0, 2.7, 0] },
    { op: 'add', type: 'camera', id: 'main', position: [0, 1.4, 4], target: [0, 1.5, 0], vfov_deg: 60 },
];
const daemon = serve(sceneFile(SCENE.map((op) => JSON.stringify(op))), fileURLToPath(new URL('../../photometry', import.meta.url)));
/** One sample a pixel shows what these tests look for. */
const edit = (action) => editTo(action, 1);

test('an address with a token, put into the same tab, is used', async () => {
    await page.evaluate(() => (location.hash = '#t=of-another-server'));
    await page.getByText('locked').waitFor();
    await page.evaluate((hash) => (location.hash = hash), new URL(daemon.url).hash);
    await page.getByText('connected', { exact: true }).waitFor();
    assert.equal(new URL(page.url()).hash, '');
    tab.watch.errors.length = 0; // of the connection that was refused
});

test('a lamp with a file is aimed and copied as others are', async () => {
    await select(page, 'hung');
    await edit(() => field(page, 'hung', 'Tilt').fill('30').then(() => page.keyboard.press('Enter')));
    await edit(() => page.locator('.stage').press('Control+d'));
    await row(page, 'hung-2').locator('.light-details').waitFor();
    assert.deepEqual(await numbers('hung-2', 'Tilt'), [30]);
    await edit(() => page.locator('.stage').press('Delete'));
});

test('what a sky shines in place of is told in the list of lights', async () => {
    await edit(() => page.getByRole('button', { name: 'Add sun and sky' }).click());
    assert.match(await row(page, 'even').innerText(), /replaced by sky/);
    await edit(() => field(page, 'sky', 'sky on').click());
    assert.match(await row(page, 'even').innerText(), /10\s*cd/);
});

test('the page itself never scrolls, whatever is looked at', async () => {
    for (const title of ['#lights-title', '#sensors-title', '#effects-title', '#import-title']) {
        await page.locator(title).evaluate((e) => e.scrollIntoView());
        const [top, height, room] = await page.evaluate(() => {
            const { scrollTop, scrollHeight, clientHeight } = document.scrollingElement;
            return [scrollTop, scrollHeight, clientHeight];
        });
        assert.deepEqual([top, height], [0, room], title);
    }
});

const said = () => page.locator('.visually-hidden[role=status][aria-live]').textContent();
const luminaire = (name) => page.getByRole('option', { name });

test('the folder’s luminaires are listed with what their files say, and found by it', async () => {
    await eventually(async () => (await page.locator('.library-row').allInnerTexts()).every((t) => / lm/.test(t)), () => 'not read');
    assert.equal(await page.locator('.library-row').count(), 3);
    assert.match(await page.locator('.library-row[title="downlight.ies"]').innerText(), /877\.7 lm · 9\.5 W · 92 lm\/W/);
    assert.ok((await page.locator('.library-row[title="linear.ldt"] .polar-c0').getAttribute('d')).length > 100);
    const search = page.getByLabel('Search luminaires by name or file');
    await search.fill('linear');
    assert.equal(await page.locator('.library-row').count(), 1);
    await search.fill('no such lamp');
    await page.getByText('No luminaire matches').waitFor();
    await search.fill('');
});

test('one is dragged into the picture and hangs under the ceiling where it was let go; one undo takes it back', async () => {
    await page.locator('.library-list').scrollIntoViewIfNeeded();
    const [from, stage] = [await page.locator('.library-row[title="downlight.ies"]').boundingBox(), await page.locator('.stage').boundingBox()];
    await page.mouse.move(from.x + 80, from.y + 20);
    await page.mouse.down();
    await page.mouse.move(stage.x + 0.5 * stage.width, stage.y + 0.18 * stage.height, { steps: 5 });
    await page.locator('.drag-ghost', { hasText: 'on ceiling, 2.80 m high' }).waitFor();
    await page.keyboard.press('Escape');
    assert.equal(await page.locator('.drag-ghost').count(), 0, 'Escape ends it');
    await page.mouse.move(stage.x + 0.5 * stage.width, stage.y + 0.17 * stage.height, { steps: 2 });
    await edit(() => page.mouse.up());
    await row(page, 'downlight').locator('.light-details').waitFor();
    const [x, y] = await numbers('downlight', 'X', 'Y');
    assert.ok(Math.abs(x) < 0.2 && y > 2.7 && y < 2.8, `${x}, ${y}`);
    assert.deepEqual(await numbers('downlight', 'Tilt'), [0]);
    await row(page, 'downlight').locator('.luminaire', { hasText: '877.7 lm' }).waitFor();
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await row(page, 'downlight').count(), 0);
});

test('by keyboard alone one is chosen, hung, moved, and made into rows over the whole floor', async () => {
    const list = page.getByRole('listbox');
    await list.focus();
    await page.keyboard.press('End');
    await page.keyboard.press('Home');
    assert.equal(await luminaire(/downlight|877/).getAttribute('aria-selected'), 'true');
    await edit(() => page.keyboard.press('Enter'));
    await eventually(async () => /^Placed downlight/.test(await said()), said);
    await eventually(() => page.evaluate(() => document.activeElement?.closest('.lamp') !== null), () => 'its handle has no focus');
    const [x, y, z] = await numbers('downlight', 'X', 'Y', 'Z');
    await edit(() => page.keyboard.press('Shift+ArrowRight'));
    const moved = await numbers('downlight', 'X', 'Y', 'Z');
    assert.ok(moved[0] > x && moved[1] === y && Math.abs(moved[2] - z) < 0.5, `${[x, y, z]} to ${moved}`);
    await page.getByRole('button', { name: 'Rows…' }).press('Enter');
    const form = page.getByRole('group', { name: 'Rows of downlight' });
    await form.getByLabel('Rows', { exact: true }).fill('2');
    await form.getByLabel('Rows', { exact: true }).press('Enter');
    await form.getByText('8 lamps, 7\u2009022 lm, 76 W').waitFor();
    await edit(() => form.getByRole('button', { name: 'Spread over the floor' }).press('Enter'));
    await page.getByRole('switch', { name: 'Group downlight on' }).waitFor();
    assert.deepEqual(await numbers('downlight', 'X', 'Y', 'Z'), [-1.5, y, -0.75]);
    await select(page, 'downlight-8');
    assert.deepEqual(await numbers('downlight-8', 'X', 'Y', 'Z'), [1.5, y, 0.75]);
});

test('axe finds nothing in the library, a chosen luminaire, the facts of a lamp and its rows', async () => {
    await page.getByRole('button', { name: 'Rows…' }).click();
    await page.locator('.sections').evaluate((e) => e.scrollTo(0, 0));
    assert.deepEqual(await violations(page), []);
});

test('a section is gone to by its name, and the Tab key goes on from there', async () => {
    await page.getByRole('navigation', { name: 'Sections of the panel' }).getByRole('button', { name: 'Measure' }).press('Enter');
    await page.keyboard.press('Tab');
    assert.equal(await page.evaluate(() => document.activeElement.textContent), 'Add work plane');
});

test('nothing was written to the console as an error', () => assert.deepEqual(tab.watch.errors, []));
