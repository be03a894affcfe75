// A link to a view: who opens it sees the same scene, from the same camera, shown the same. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, open, settled } from './browser.mjs';
import { context, page, ROOM, serve, tab, violations } from './stage.mjs';

const daemon = serve(ROOM);
const token = () => new URL(daemon.url).hash.replace('#t=', '');
const opened = (of) => of.watch.sent.findLast((m) => m.method === 'view.open').params;
const newest = (of, member) => of.watch.sent.findLast((m) => /^view\.(open|update)$/.test(m.method) && m.params[member] !== undefined).params[member];
const spoken = (of, text) => of.locator('.visually-hidden[role=status]', { hasText: text }).first().waitFor({ state: 'attached' });
let link;

test('by keyboard: a link is made of what is shown, without the token', async () => {
    await context.grantPermissions(['clipboard-read', 'clipboard-write']);
    await page.locator('.stage').focus();
    for (const key of ['ArrowLeft', 'ArrowUp', '+', ']', ']', 'c', 'c']) await page.keyboard.press(key);
    await page.getByLabel('Tone map').selectOption('aces');
    await page.getByLabel('Method').selectOption('path');
    await settled(tab);
    const button = page.getByRole('button', { name: 'Copy link' });
    await button.focus();
    await page.keyboard.press('Enter');
    await spoken(page, /^The link is copied$/);
    link = await page.evaluate(() => navigator.clipboard.readText());
    assert.ok(link.startsWith(`http://127.0.0.1:${daemon.port}/#view=1&eye=`), link);
    assert.ok(token().length > 8 && !link.includes(token()), 'the token is in the link');
    assert.deepEqual(await violations(page), []);
});

test('who opens it has the same camera, method, exposure and map; a token is asked for, and the link waits', async () => {
    const other = await open(context, link);
    await other.page.getByLabel('Access token', { exact: true }).fill(token());
    await other.page.getByLabel('Access token', { exact: true }).press('Enter');
    await settled(other, { spp: 1 });
    const [mine, theirs] = [newest(tab, 'camera'), opened(other).camera];
    for (const end of ['position', 'target', 'up']) mine[end].forEach((v, i) => assert.ok(Math.abs(v - theirs[end][i]) < 1e-5, `${end}: ${mine[end]}, ${theirs[end]}`));
    assert.equal(theirs.vfov_deg, mine.vfov_deg);
    assert.ok(Math.abs(newest(other, 'exposure_ev') - newest(tab, 'exposure_ev')) < 1e-5, 'numbers of a link have seven digits');
    for (const member of ['method', 'tone_map', 'overlay']) assert.deepEqual(newest(other, member), newest(tab, member), member);
    assert.equal(await other.page.evaluate(() => location.hash), '', 'the user goes on from there');
    assert.deepEqual(other.watch.errors, []);
    await other.page.close();
});

test('a link in the page that is open moves its camera; what is no good in it is named, and nothing breaks', async () => {
    await page.evaluate(() => (location.hash = '#view=1&eye=1,1.2,1.5&at=0,1,0&ev=1e9&tone=<b>&effects=glossy:off'));
    const toast = page.locator('.toast', { hasText: 'of the link is not used' });
    await toast.waitFor();
    assert.match(await toast.textContent(), /“ev”.*a number from -40 to 40.*“tone”.*agx, aces/s);
    await eventually(() => Math.abs(newest(tab, 'camera').position[0] - 1) < 1e-9, () => JSON.stringify(newest(tab, 'camera')));
    assert.equal(newest(tab, 'effects').glossy, 'off');
    assert.equal(newest(tab, 'overlay'), 'none', 'what it does not name is as usual');
    await eventually(() => opened(tab).method === undefined && opened(tab).tone_map === undefined, () => `a view that has the scene’s: ${JSON.stringify(opened(tab))}`);
    await settled(tab);
    assert.equal(tab.watch.stats.at(-1).method, 'live', 'the scene’s');
    assert.deepEqual(tab.watch.errors, []);
});

test('where the browser lets no page copy, the link is in a field, selected', async () => {
    await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined }));
    await page.getByRole('button', { name: 'Copy link' }).click();
    const field = page.getByLabel('Link to this view, to be copied');
    await eventually(() => field.evaluate((e) => e === document.activeElement && e.selectionEnd === e.value.length), () => 'it is not selected');
    assert.match(await field.inputValue(), /#view=1&eye=1,1\.2,1\.5&at=0,1,0&/);
    assert.deepEqual(await violations(page), []);
    await page.keyboard.press('Tab');
    assert.equal(await field.count(), 0);
});
