// Light read off the picture: false colour, its scale, lines, and the value of a place. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, field, settled, shownRev } from './browser.mjs';
import { ROOM, page, serve, tab, violations } from './stage.mjs';

serve(ROOM);
const legend = () => page.getByRole('complementary', { name: 'Legend' });

/** The value and its error, of "1 234 lx ± 5"; NaN where it does not say. */
function numbersIn(text) {
    const [value, error] = text.replace(/[\u2009 ]/g, '').split(/lx|cd\/m²|±/).filter((part) => part !== '');
    return [Number(value), Number(error)];
}
const told = () => tab.watch.stats.at(-1).overlay;

test('illuminance is read in the middle of the picture as the light meter has it there, and under the pointer', async () => {
    await page.locator('.stage').focus();
    await page.keyboard.press('c');
    await page.keyboard.press('c');
    await settled(tab, { spp: 12 });
    assert.equal(told().unit, 'lx');
    const value = legend().locator('.legend-value');
    await eventually(async () => numbersIn(await value.locator('dd').textContent())[1] > 0, async () => value.textContent());
    assert.match(await value.textContent(), /^In the middle/);
    await page.keyboard.press('Enter');
    const meter = page.locator('.reading-lux:not(.is-old)');
    await eventually(async () => numbersIn(await meter.textContent())[1] > 0, async () => meter.textContent());
    // Four errors of both, and half a pixel.
    const near = async () => {
        const [shown, off] = numbersIn(await value.locator('dd').textContent());
        const [lx, stderr] = numbersIn((await meter.textContent()).replace(/measuring.*/, ''));
        return Math.abs(shown - lx) <= 4 * Math.hypot(off, stderr) + 0.01 * lx;
    };
    await eventually(near, async () => `${await value.textContent()}, light meter: ${await meter.textContent()}`);
    const stage = await page.locator('.stage').boundingBox();
    await page.mouse.move(stage.x + 0.6 * stage.width, stage.y + 0.8 * stage.height);
    await value.getByText('Under the pointer').waitFor();
    await page.locator('.stage').press('Escape');
    assert.deepEqual(tab.watch.errors, []);
});

test('scale, colours, lines and range by keyboard alone', async () => {
    const options = legend().getByRole('button', { name: 'Scale and lines' });
    await options.focus();
    await page.keyboard.press('Enter');
    assert.equal(await options.getAttribute('aria-expanded'), 'true');
    const choose = async (name, key) => {
        await page.getByRole('combobox', { name, exact: true }).focus();
        await page.keyboard.press(key);
        await settled(tab);
    };
    assert.deepEqual([told().scale, told().smooth], ['log', false]);
    const items = await legend().getByRole('listitem').count();
    assert.equal(items, told().colors.length);
    await choose('Lines', 'ArrowDown');
    await eventually(() => told().labels.length > 0, () => JSON.stringify(told().labels));
    await eventually(async () => (await page.locator('.isolines text').count()) === told().labels.length, () => 'labels of lines');
    for (const [, , lx] of told().labels) assert.ok(told().limits.includes(lx), `${lx} is no limit of the scale`);
    await choose('Scale', 'ArrowDown');
    await eventually(() => told().scale === 'linear' && told().min === 0, () => JSON.stringify(told()));
    await choose('Colours', 'ArrowDown');
    await eventually(() => told().smooth, () => 'still in steps');
    assert.equal(await legend().getByRole('listitem').count(), told().limits.length);
    assert.deepEqual(await violations(page), []);
    // The range is held while a lamp is dimmed.
    await legend().getByRole('button', { name: 'Hold this range' }).press('Enter');
    const { min, max, limits } = told();
    const rev = await shownRev(page);
    await field(page, 'ceiling-panel', 'ceiling-panel on').click();
    await settled(tab, { rev: rev + 1 });
    assert.deepEqual([told().min, told().max, told().limits], [min, max, limits]);
    await legend().getByLabel('To').fill('250');
    await legend().getByLabel('To').press('Enter');
    await eventually(() => told().max === 250, () => JSON.stringify(told().max));
    await legend().getByRole('button', { name: 'Hold this range' }).press('Enter');
    await eventually(() => told().max !== 250, () => 'the range is still held');
    await legend().getByRole('button', { name: 'Hide' }).press('Enter');
    await settled(tab);
    assert.equal(await legend().count(), 0);
    assert.equal(await page.locator('.isolines').count(), 0);
    assert.deepEqual(tab.watch.errors, []);
});

/** Pairs of boxes that lie on each other by more than rounding: half a pixel. */
const overlapping = (locator) =>
    locator.evaluateAll((all) => {
        const boxes = all.map((e) => e.getBoundingClientRect());
        const meet = (a, b) => a.left + 0.5 < b.right && b.left + 0.5 < a.right && a.top + 0.5 < b.bottom && b.top + 0.5 < a.bottom;
        return all.flatMap((e, i) => all.slice(0, i).flatMap((o, k) => (meet(boxes[i], boxes[k]) ? [`${e.textContent} and ${o.textContent}`] : [])));
    });

test('points of a work plane lie in the picture, by what is wanted of them, and as in words', async () => {
    await page.getByRole('button', { name: 'Add work plane' }).press('Enter');
    const plane = page.locator('.sensor');
    await plane.getByText(/^\d+ of \d+ points reach 500 lx/).waitFor();
    const points = page.locator('.sensor-points .point');
    const agree = async () => {
        const [, met, n, , missed = '0'] = /^(\d+) of (\d+) points reach 500 lx(, (\d+) (is|are) below 300)?/.exec(await plane.locator('.hint').textContent());
        const counts = await Promise.all(['.is-met', '.is-missed'].map((c) => page.locator(`.sensor-points ${c}`).count()));
        return (await points.count()) === Number(n) && counts[0] === Number(met) && counts[1] === Number(missed);
    };
    await eventually(agree, async () => `${await points.count()} points, ${await plane.textContent()}`);
    assert.ok((await page.locator('.sensor-points text').count()) > 5, 'with numbers');
    // Another over the same desks: no number lies on another, and no field on another in the panel.
    await page.getByRole('button', { name: 'Add work plane' }).press('Enter');
    await eventually(async () => (await page.locator('.sensor-points > g').count()) === 2, () => 'one sensor shows points');
    assert.deepEqual(await overlapping(page.locator('.sensor-points text')), []);
    assert.deepEqual(await overlapping(page.locator('.sensor .fields > *')), []);
    await page.locator('.sensor').last().getByRole('button', { name: /^Remove/ }).press('Enter');
    await eventually(async () => (await plane.count()) === 1, () => 'it is still there');
    assert.deepEqual(await violations(page), []);
    const toggle = page.getByRole('button', { name: 'Points' });
    assert.equal(await toggle.getAttribute('aria-pressed'), 'true');
    await toggle.press('Enter');
    assert.equal(await points.count(), 0);
    await toggle.press('Enter');
    await eventually(async () => (await points.count()) > 0, () => 'no points again');
    assert.deepEqual(tab.watch.errors, []);
});
