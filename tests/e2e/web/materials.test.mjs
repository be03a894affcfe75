// What things are made of, in the panel: picked, changed by slider, number and finish, by two people. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, measure, open, settled } from './browser.mjs';
import { ROOM, context, edit, page, serve, tab, violations } from './stage.mjs';

const daemon = serve(ROOM);

const panelOf = (p) => p.getByRole('region', { name: 'Material' });
const slider = (p, name) => panelOf(p).getByRole('slider', { name, exact: true });
const number = (p, name) => panelOf(p).getByRole('spinbutton', { name, exact: true });
const shown = (p) => panelOf(p).getByLabel('Material on show').inputValue();
/** y: not where the mark of the last pick is, which a click would frame. */
const pickBlock = async (p, y = 0.7) => {
    const stage = await p.locator('.stage').boundingBox();
    await p.mouse.click(stage.x + 0.4 * stage.width, stage.y + y * stage.height);
    await p.locator('.reading', { hasText: 'block' }).waitFor();
};

test('what is clicked shows its material, with the share of light that it reflects', async () => {
    await panelOf(page).getByText('Choose one, or click on an object').waitFor({ state: 'attached' });
    await pickBlock(page);
    assert.equal(await shown(page), 'white');
    // 0.2126 0.74 + 0.7152 0.73 + 0.0722 0.7, without gloss
    assert.equal(await number(page, 'Reflectance ρ').inputValue(), '73');
    assert.equal(await slider(page, 'Reflectance ρ').getAttribute('aria-valuetext'), '73 percent');
    assert.equal(await panelOf(page).locator('.carriers-of').textContent(), 'On block and 3 others');
    const card = page.getByRole('complementary', { name: 'Picked point' });
    await card.getByRole('button', { name: 'white, ρ 73 %' }).click();
    assert.equal(await page.evaluate(() => document.activeElement.id), 'material-title');
});

test('a copy for one object, and a finish for it by keyboard: the others stay as they are', async () => {
    await edit(() => panelOf(page).getByRole('button', { name: 'Make its own' }).click());
    await eventually(async () => (await shown(page)) === 'block-material', () => shown(page));
    assert.equal(await panelOf(page).locator('.carriers-of').textContent(), 'On block alone');
    const before = (await measure(page, [0.36, 0.65, 0.44, 0.75])).mean;
    const finish = panelOf(page).getByLabel('Finish');
    await finish.focus();
    await edit(() => page.keyboard.type('Black p'), 4); // a list is chosen from by the first letters
    assert.equal(await finish.inputValue(), 'Black paint');
    assert.equal(await number(page, 'Reflectance ρ').inputValue(), '5');
    const after = (await measure(page, [0.36, 0.65, 0.44, 0.75])).mean;
    assert.ok(after < 0.3 * before, `${after} after ${before}`);
    await panelOf(page).getByLabel('Material on show').selectOption('white');
    assert.equal(await number(page, 'Reflectance ρ').inputValue(), '73');
    await panelOf(page).getByRole('button', { name: 'Put it on block' }).waitFor();
    await pickBlock(page, 0.77); // its own again
    await eventually(async () => (await shown(page)) === 'block-material', () => shown(page));
});

test('a slider by keys is one step of undo, a number is typed, and colours keep what sheets let through', async () => {
    const rho = slider(page, 'Reflectance ρ');
    await edit(async () => {
        await rho.focus();
        for (let i = 0; i < 3; i++) await page.keyboard.press('PageUp');
    });
    await eventually(async () => (await number(page, 'Reflectance ρ').inputValue()) === '35', () => number(page, 'Reflectance ρ').inputValue());
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await number(page, 'Reflectance ρ').inputValue(), '5');
    await edit(async () => {
        await number(page, 'Reflectance ρ').fill('80');
        await page.keyboard.press('Enter');
    });
    assert.equal(await number(page, 'Reflectance ρ').inputValue(), '80');
    await panelOf(page).getByRole('button', { name: /^More: lacquer, brushed, glass, translucent, cloth, emission$/ }).click();
    await edit(async () => {
        await number(page, 'Transmittance τ').fill('60'); // of 20 % that are left
        await page.keyboard.press('Enter');
    });
    assert.equal(await number(page, 'Transmittance τ').inputValue(), '20');
    await edit(async () => {
        await number(page, 'Stretch').fill('0.7');
        await page.keyboard.press('Enter');
    });
    // The first step of a part's slider brings it into use: it stays in hand, in its place.
    const focused = () => page.evaluate(() => document.activeElement.getAttribute('aria-label'));
    await edit(async () => {
        await slider(page, 'Lacquer').focus();
        await page.keyboard.press('ArrowRight');
    });
    await panelOf(page).getByRole('button', { name: 'Less' }).waitFor();
    assert.equal(await focused(), 'Lacquer');
    await edit(() => page.keyboard.press('ArrowRight'));
    assert.equal(await slider(page, 'Lacquer').getAttribute('aria-valuetext'), '0.02');
    await panelOf(page).getByRole('button', { name: 'Less' }).click();
    assert.deepEqual(await panelOf(page).getByRole('group').evaluateAll((all) => all.map((g) => g.getAttribute('aria-label')).filter(Boolean)), ['Lacquer', 'Brushed', 'Translucent']);
    assert.deepEqual(await violations(page), []);
    await page.setViewportSize({ width: 1440, height: 900 });
    if (process.env.LUMEND_SHOT) await page.screenshot({ path: process.env.LUMEND_SHOT });
});

test('two people see each other’s changes, and each takes back only what is theirs', async () => {
    const other = await open(context, daemon.url);
    await other.page.getByLabel('Resolution').selectOption('fast');
    await settled(other);
    await panelOf(other.page).getByLabel('Material on show').selectOption('block-material');
    assert.equal(await number(other.page, 'Reflectance ρ').inputValue(), '80');
    await number(other.page, 'Roughness').fill('0.25');
    await other.page.keyboard.press('Enter');
    await eventually(async () => (await number(page, 'Roughness').inputValue()) === '0.25', () => number(page, 'Roughness').inputValue());
    await panelOf(page).locator('.others-mark').waitFor({ state: 'attached' });
    const lacquer = slider(other.page, 'Lacquer');
    assert.equal(await lacquer.getAttribute('aria-valuetext'), '0.02');
    await edit(() => page.locator('.stage').press('z')); // of the lacquer
    await eventually(async () => (await lacquer.getAttribute('aria-valuetext')) !== '0.02', () => panelOf(other.page).textContent());
    assert.equal(await number(page, 'Roughness').inputValue(), '0.25');
    await other.page.close();
    assert.deepEqual([...tab.watch.errors, ...other.watch.errors], []);
});

test('haze of a thin pane sets its roughness, and is told back', async () => {
    await edit(() => panelOf(page).getByLabel('Finish').selectOption('Satin glass'));
    // Of GGX r^4 / (r^4 + tan^2 1.25°)
    await eventually(async () => (await number(page, 'Haze').inputValue()) === '99.2', () => number(page, 'Haze').inputValue());
    await edit(async () => {
        await number(page, 'Haze').fill('30');
        await page.keyboard.press('Enter');
    });
    assert.equal(await number(page, 'Roughness').inputValue(), '0.12');
    assert.equal(await number(page, 'Haze').inputValue(), '30');
    assert.equal(await slider(page, 'Haze').getAttribute('aria-valuetext'), '30 percent');
    assert.deepEqual(await violations(page), []);
    await edit(() => panelOf(page).getByRole('checkbox', { name: 'Thin pane: it bends nothing' }).click());
    assert.equal(await slider(page, 'Haze').count(), 0);
});
