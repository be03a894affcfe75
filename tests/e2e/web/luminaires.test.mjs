// Lamps with photometric files, as a designer works with them. Assets: tests/photometry.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { eventually, field, launch, open, row, select, settled, shownRev } from './browser.mjs';
import { Daemon } from './daemon.mjs';

const quad = (id, size, transform) => [
    { op: 'add', type: 'mesh', id: `${id}-mesh`, shape: 'quad', size },
    { op: 'add', type: 'object', id, mesh: `${id}-mesh`, material: 'white', transform },
];
/** 4 x 3 m, 2.8 m high, seen from a corner. */
const SCENE = [
    { lumend: 1, kind: 'scene' },
    { op: 'add', type: 'material', id: 'white', base_color: [0.7, 0.7, 0.7], specular: 0 },
    ...quad('floor', [4, 0, 3], {}),
    ...quad('ceiling', [4, 0, 3], { translate: [0, 2.8, 0], rotate_deg: [180, 0, 0] }),
    ...quad('wall', [4, 0, 2.8], { translate: [0, 1.4, -1.5], rotate_deg: [90, 0, 0] }),
    { op: 'add', type: 'light', id: 'even', kind: 'environment', luminance_cd_m2: 10 },
    { op: 'add', type: 'light', id: 'hung', kind: 'ies', asset: 'downlight.ies', position: [0, 2.7, 0] },
    { op: 'add', type: 'camera', id: 'main', position: [0, 1.4, 4], target: [0, 1.5, 0], vfov_deg: 60 },
];
const file = join(mkdtempSync(join(tmpdir(), 'lumend-e2e-')), 'room.jsonl');
writeFileSync(file, SCENE.map((line) => `${JSON.stringify(line)}\n`).join(''));
const daemon = new Daemon(file, fileURLToPath(new URL('../../photometry', import.meta.url)));
let context;
let tab;
let page;

before(async () => {
    await daemon.start();
    context = await launch();
    tab = await open(context, daemon.url);
    page = tab.page;
    await page.getByLabel('Resolution').selectOption('fast');
    await settled(tab);
});

after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

async function edit(action) {
    const rev = await shownRev(page);
    await action();
    await settled(tab, { rev: rev + 1, spp: 1 });
}
const numbers = (id, ...labels) => Promise.all(labels.map(async (label) => Number(await field(page, id, label).inputValue())));

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

test('nothing was written to the console as an error', () => assert.deepEqual(tab.watch.errors, []));
