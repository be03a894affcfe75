// Two pictures in one: before and after, fast and exact. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { drag, eventually, field, launch, measure, open, settled, shownRev } from './browser.mjs';
import { Daemon } from './daemon.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
const AXE = readFileSync(createRequire(new URL('../../../clients/web/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');
const daemon = new Daemon(ROOM);
let context;
let tab;
let page;
let panel;
let line;

before(async () => {
    await daemon.start();
    context = await launch();
    tab = await open(context, daemon.url);
    page = tab.page;
    panel = page.getByRole('region', { name: 'Compare' });
    line = page.getByRole('slider', { name: 'Line between two pictures' });
    await page.getByLabel('Resolution').selectOption('fast');
    await settled(tab);
});

after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

async function assertAccessible() {
    // Else the names of sections, which stay, may lie over half of a slider.
    await page.getByRole('button', { name: 'Compare', exact: true }).click();
    await page.evaluate(AXE);
    const { violations } = await page.evaluate(() => window.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'wcag22aa'] }));
    assert.deepEqual(violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.target).join()}`), []);
}

const spoken = (text) => page.locator('.visually-hidden[role=status]', { hasText: text }).first().waitFor({ state: 'attached' });
const tag = (side) => page.locator(`.wipe-tag.is-${side}`);
/** Requests of this page by name. */
const asked = (method) => tab.watch.sent.filter((m) => m.method === method);

/** Mean value of the pixels that lie over the picture, 0 to 255, and where they do. */
function over() {
    return page.evaluate(() => {
        const canvas = document.querySelector('.wipe-picture canvas');
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const mean = data.reduce((sum, v, i) => sum + (i % 4 === 3 ? 0 : v), 0) / ((3 * data.length) / 4);
        return { mean, clip: document.querySelector('.wipe-clip').style.clipPath };
    });
}

test('by keyboard: a picture is kept, the light changed, and a line moved between before and after', async () => {
    await page.locator('.stage').focus();
    await page.keyboard.press('k');
    await spoken(/^Kept as Picture 1: live, \d+ samples?, .* revision \d+$/);
    const bright = (await measure(page)).mean;
    const rev = await shownRev(page);
    const lamp = field(page, 'ceiling-panel', 'ceiling-panel on');
    await lamp.focus();
    await page.keyboard.press('Space');
    await settled(tab, { rev: rev + 1 });
    await page.locator('.stage').focus();
    await page.keyboard.press('w');
    await spoken(/^Left of the line Picture 1, right of it Now/);
    await eventually(() => line.evaluate((e) => e === document.activeElement), () => 'the line has no focus');
    assert.match(await tag('left').textContent(), new RegExp(`^Picture 1.*revision ${rev}$`));
    assert.match(await tag('right').textContent(), new RegExp(`^Now.*revision ${rev + 1}$`));
    assert.ok((await measure(page)).mean < 0.7 * bright, 'now is darker');
    const kept = await over();
    assert.ok(kept.mean > 0, 'the kept picture is not black');
    assert.match(kept.clip, /^inset\(0px 50% 0px 0px\)$/);
    for (const [key, now] of [['ArrowRight', 52], ['PageDown', 42], ['Home', 0], ['End', 100], ['Enter', 0]]) {
        await page.keyboard.press(key);
        await eventually(async () => Number(await line.getAttribute('aria-valuenow')) === now, () => line.getAttribute('aria-valuenow'));
    }
    assert.equal(await line.getAttribute('aria-valuetext'), 'all Now');
    assert.equal(asked('view.update').filter((m) => m.params.camera).length, 0, 'the camera stays');
    await page.keyboard.press('Escape');
    assert.equal(await line.count(), 0);
    assert.ok(await page.locator('.stage').evaluate((e) => e === document.activeElement), 'the focus goes back to the picture');
    assert.deepEqual(tab.watch.errors, []);
});

test('the line is dragged, and the pictures below it are chosen from a list', async () => {
    await panel.getByRole('button', { name: 'Keep this picture' }).click();
    await panel.getByLabel('Name of Picture 2').fill('dark');
    await panel.getByLabel('Name of Picture 2').press('Enter');
    await panel.getByRole('button', { name: 'Wipe between Picture 1 and now' }).click();
    await panel.getByLabel('Right of it').selectOption({ label: 'dark' });
    assert.match(await tag('right').textContent(), /^dark/);
    assert.equal(await page.locator('.wipe-picture').count(), 2);
    const box = await line.boundingBox();
    const stage = await page.locator('.stage').boundingBox();
    const from = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    await drag(page, from, { x: stage.x + 0.25 * stage.width, y: from.y + 40 });
    await eventually(async () => (await line.getAttribute('aria-valuenow')) === '25', () => line.getAttribute('aria-valuenow'));
    await assertAccessible();
    await panel.getByRole('button', { name: 'Forget dark' }).click();
    assert.equal(await line.count(), 0, 'what is gone is not shown');
    assert.deepEqual(tab.watch.errors, []);
});

test('the picture before the last change was kept without being asked for; numbers of now stay at its side', async () => {
    const rev = await shownRev(page);
    await field(page, 'ceiling-panel', 'ceiling-panel on').click();
    await settled(tab, { rev: rev + 1 });
    await panel.getByRole('button', { name: 'Before' }).click();
    assert.match(await tag('left').textContent(), new RegExp(`^Before.*revision ${rev}$`));
    const side = () => page.locator('#nows-side rect').evaluate((r) => [r.x.baseVal.value, r.width.baseVal.value]);
    const { width } = await page.locator('.stage').boundingBox();
    const [from, wide] = await side();
    assert.ok(Math.abs(from - 0.25 * width) < 2 && Math.abs(wide - 0.75 * width) < 2, `${from}, ${wide} of ${width}`);
    await panel.getByLabel('Right of it').selectOption('Picture 1');
    assert.equal((await side())[1], 0, 'now is not shown');
    await page.locator('.stage').press('z'); // takes the switch back: that is a change, too
    await settled(tab, { rev: rev + 2 });
    await eventually(async () => new RegExp(`revision ${rev + 1}$`).test(await tag('left').textContent()), () => tag('left').textContent());
    await panel.getByRole('button', { name: 'Before' }).click();
    assert.equal(await line.count(), 0);
    assert.deepEqual(tab.watch.errors, []);
});

test('another camera is said to be one, and gone back to', async () => {
    await panel.getByRole('button', { name: 'Wipe between Picture 1 and now' }).click();
    assert.equal(await tag('left').locator('em').count(), 0);
    await page.locator('.stage').focus();
    await page.keyboard.press('ArrowLeft');
    await tag('left').getByText('another camera').waitFor();
    await panel.getByRole('button', { name: 'Go to the camera of Picture 1' }).click();
    await eventually(async () => (await tag('left').locator('em').count()) === 0, async () => tag('left').textContent());
    await page.getByRole('button', { name: 'Close the comparison' }).click();
    assert.equal(await line.count(), 0);
    assert.deepEqual(tab.watch.errors, []);
});

test('the reference is a second view, path traced, at the same exposure; it follows edits and cameras, and is closed', async () => {
    await settled(tab);
    const reference = panel.getByRole('button', { name: 'Reference' });
    await reference.focus();
    await page.keyboard.press('Enter');
    await eventually(async () => /^Referencepath, \d+ sample/.test(await tag('left').textContent()), () => tag('left').textContent());
    const { params } = asked('view.open').at(-1);
    assert.equal(params.method, 'path');
    assert.equal(params.exposure_ev, tab.watch.stats.at(-1).exposure_ev);
    const before = await over();
    const main = Number(await page.locator('.picture').getAttribute('data-rev'));
    const lamp = field(page, 'ceiling-panel', 'ceiling-panel on');
    await lamp.click();
    await eventually(
        async () => new RegExp(`revision ${main + 1}$`).test(await tag('left').textContent()),
        async () => `reference: ${await tag('left').textContent()}`,
    );
    assert.ok((await over()).mean > before.mean, 'the lamp is on in it');
    // Both go on; the numbers of the view beside it are not those of the reference.
    await eventually(async () => /(\d+) samples/.test(await tag('left').textContent()), () => tag('left').textContent());
    assert.match(await tag('right').textContent(), /^Nowlive/);
    await page.locator('.stage').focus();
    await page.keyboard.press('ArrowRight');
    const turned = () => asked('view.update').filter((m) => m.params.view_id === 2 && m.params.camera);
    await eventually(() => turned().length > 0, () => 'the reference was not turned');
    await eventually(async () => /^Referencepath/.test(await tag('left').textContent()), () => tag('left').textContent());
    await eventually(async () => (await tag('left').locator('em').count()) === 0, () => 'of another camera');
    await assertAccessible();
    await reference.click();
    await eventually(() => asked('view.close').some((m) => m.params.view_id === 2), () => 'it was not closed');
    assert.deepEqual(tab.watch.errors, []);
});
