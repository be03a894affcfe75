// Two browsers in one scene: each sees where the other stands and what it points at, until it goes. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, launch, open, settled } from './browser.mjs';
import { page, ROOM, serve, tab, violations } from './stage.mjs';

const daemon = serve(ROOM);
const row = (of) => of.getByRole('region', { name: 'People' }).locator('li');
const camera = (of) => of.watch.sent.findLast((m) => /^view\.(open|update)$/.test(m.method) && m.params.camera)?.params.camera;
const asked = (of, method) => of.watch.sent.filter((m) => m.method === method);

test('two browsers see each other, in the picture and in a list, and go where the other stands', async () => {
    assert.equal(await row(page).count(), 0, 'nobody else is here');
    assert.equal(asked(tab, 'pick').length, 0);
    const tops = () => page.locator('.light').evaluateAll((lines) => lines.map((l) => l.getBoundingClientRect().top));
    const alone = await tops();
    const browser = await launch();
    const other = await open(browser, daemon.url);
    await settled(other);
    await row(page).waitFor();
    assert.ok(alone.length > 0);
    assert.deepEqual(await tops(), alone, 'whoever comes moves no lamp of the list');
    assert.match(await row(page).textContent(), /Guest.*edits/);
    await other.page.locator('.stage').focus();
    for (let i = 0; i < 6; i++) await other.page.keyboard.press('ArrowLeft');
    for (let i = 0; i < 8; i++) await page.locator('.stage').press('-');
    await settled(other);
    await eventually(async () => (await page.locator('.person-eye').count()) === 1, () => 'no camera is drawn');
    const box = await other.page.locator('.stage').boundingBox();
    await other.page.mouse.move(box.x + box.width / 2, box.y + 0.8 * box.height);
    await eventually(async () => (await page.locator('.person-point').count()) === 1, () => 'no pointer is drawn');
    assert.match(await page.locator('.people-marks').textContent(), /Guest/, 'a name, and not the colour alone');
    assert.deepEqual(await violations(page), []);
    await page.getByRole('button', { name: /^Their view: look from where Guest.* stands$/ }).focus();
    await page.keyboard.press('Enter');
    const [mine, theirs] = [() => camera(tab).position, () => camera(other).position];
    await eventually(() => mine().every((v, i) => Math.abs(v - theirs()[i]) < 1e-6), () => `${mine()}, ${theirs()}`);
    await browser.close();
    await eventually(async () => (await row(page).count()) === 0, () => 'it is still listed');
    assert.equal(await page.locator('.person-eye, .person-point').count(), 0);
    assert.deepEqual([...tab.watch.errors, ...other.watch.errors], []);
});
