// Several lamps and objects handled as one, and what stops at a grid. Scene: six lamps and a box in a room.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { centre, drag, eventually, field, row, select, settled, shownRev } from './browser.mjs';
import { edit as editTo, numbers, page, sceneFile, serve, tab, violations } from './stage.mjs';

const quad = (id, size, transform) => [
    { op: 'add', type: 'mesh', id: `${id}-mesh`, shape: 'quad', size },
    { op: 'add', type: 'object', id, mesh: `${id}-mesh`, material: 'white', transform },
];
const bulb = (i, x, z) => ({ op: 'add', type: 'light', id: `bulb-${i}`, kind: 'spot', position: [x, 2.5, z], direction: [0, -1, 0], flux_lm: 100 * i, cct_k: 3000 });
/** 6 x 4 m, 2.8 m high, seen from the front, where no wall is. */
const SCENE = [
    { op: 'add', type: 'material', id: 'white', base_color: [0.7, 0.7, 0.7], specular: 0 },
    ...quad('floor', [6, 0, 4], {}),
    ...quad('wall', [6, 0, 2.8], { translate: [0, 1.4, -2], rotate_deg: [90, 0, 0] }),
    { op: 'add', type: 'mesh', id: 'box-mesh', shape: 'box', size: [0.6, 0.6, 0.6] },
    { op: 'add', type: 'object', id: 'box', mesh: 'box-mesh', material: 'white', transform: { translate: [0, 0.3, 0.5] } },
    bulb(1, -2, -1), bulb(2, -0.5, -1), bulb(3, 2, -1), bulb(4, -2, 1), bulb(5, 0.4, 1), bulb(6, 2, 1),
    { op: 'add', type: 'camera', id: 'main', position: [0, 1.4, 6], target: [0, 1.4, 0], vfov_deg: 50 },
];
serve(sceneFile(SCENE.map((op) => JSON.stringify(op))));
const edit = (action) => editTo(action, 1);

const panel = () => page.locator('.selection');
const inPanel = (name) => panel().getByRole('spinbutton', { name, exact: true });
const type = async (name, text) => {
    await inPanel(name).fill(text);
    await page.keyboard.press('Enter');
};
const said = () => page.locator('.visually-hidden[role=status][aria-live]').textContent();
const heading = (text) => panel().getByRole('heading', { name: text }).waitFor();
const name = (id) => row(page, id).locator('.light-name');
const flux = async (i) => (await row(page, `bulb-${i}`).locator('.light-value').innerText()).replace(/\s/g, '');
/** Messages that changed the scene since the last call. */
let counted = 0;
const applied = () => {
    const all = tab.watch.sent.filter((m) => m.method === 'scene.apply');
    const now = all.slice(counted);
    counted = all.length;
    return now;
};
/** All that is asked for is one step: one message, or one group of a gesture; and one undo takes all of it back. */
async function oneStep(action, unlike) {
    applied();
    const rev = await shownRev(page);
    await action();
    await settled(tab, { rev: rev + 1, spp: 1 });
    const sent = applied();
    assert.ok(sent.length === 1 || (sent[0]?.params.undo_group && new Set(sent.map((m) => m.params.undo_group)).size === 1), JSON.stringify(sent.map((m) => m.params)));
    const after = await unlike();
    await edit(() => page.locator('.stage').press('z'));
    await eventually(async () => JSON.stringify(await unlike()) !== JSON.stringify(after), () => 'undo took nothing back');
    const before = await unlike();
    await edit(() => page.locator('.stage').press('Shift+Z'));
    await eventually(async () => JSON.stringify(await unlike()) === JSON.stringify(after), async () => `${JSON.stringify(after)}, redone ${JSON.stringify(await unlike())}`);
    return { before, after };
}
const fluxes = () => Promise.all([1, 2, 3, 4, 5, 6].map(flux));

test('lamps are selected with Ctrl and Shift, and by keyboard alone; what they are is said', async () => {
    await name('bulb-1').click();
    await row(page, 'bulb-1').locator('.light-details').waitFor();
    await name('bulb-3').click({ modifiers: ['Control'] });
    await heading('2 lamps selected');
    assert.equal(await said(), '2 lamps selected');
    assert.deepEqual([await name('bulb-1').getAttribute('aria-pressed'), await name('bulb-2').getAttribute('aria-pressed')], ['true', 'false']);
    await name('bulb-6').click({ modifiers: ['Shift'] });
    await heading('4 lamps selected');
    await page.locator('.stage').press('Escape');
    await panel().waitFor({ state: 'detached' });
    await name('bulb-2').focus();
    await page.keyboard.press('Shift+ArrowDown');
    await page.keyboard.press('Shift+ArrowDown');
    await heading('3 lamps selected');
    await page.keyboard.press('ArrowDown');
    await page.keyboard.press('Control+ ');
    await eventually(async () => (await said()) === '4 lamps selected', said);
    await page.keyboard.press(' ');
    await heading('3 lamps selected');
    assert.equal(await page.evaluate(() => document.activeElement.title), 'bulb-5', 'the focus stays');
    await page.keyboard.press('Control+a');
    await heading('6 lamps selected');
    assert.deepEqual(await violations(page), []);
});

test('in the picture, too: lamps by their marks, objects by a click', async () => {
    await page.locator('.stage').press('Escape');
    const mark = (id) => page.locator('.lamp', { hasText: id });
    await mark('bulb-1').click({ modifiers: ['Control'] });
    await mark('bulb-3').click({ modifiers: ['Shift'] });
    await heading('2 lamps selected');
    const stage = await page.locator('.stage').boundingBox();
    await page.keyboard.down('Control');
    await page.mouse.click(stage.x + 0.5 * stage.width, stage.y + 0.72 * stage.height);
    await page.keyboard.up('Control');
    await heading('2 lamps, 1 object selected');
    assert.deepEqual(await violations(page), []);
    await mark('box').click({ modifiers: ['Control'] });
    await heading('2 lamps selected');
});

test('names of what is selected do not lie over each other: older ones give way', async () => {
    await name('bulb-2').focus();
    await page.keyboard.press('Control+a');
    await heading(/selected$/);
    const marks = await page.locator('.lamp.is-selected').count();
    const boxes = () =>
        page.locator('.lamp-name:visible').evaluateAll((names) => names.map((n) => ({ name: n.textContent, ...n.getBoundingClientRect().toJSON() })));
    for (let i = 0; i < 20 && (await boxes()).length === marks; i++) {
        await page.locator('.stage').press('-');
        await settled(tab, { spp: 1 });
    }
    const named = await boxes();
    assert.ok(named.length > 0 && named.length < marks, `${named.length} of ${marks} have names`);
    for (const a of named)
        for (const b of named)
            assert.ok(a === b || a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top, JSON.stringify([a, b]));
    const without = page.locator('.lamp.is-selected:not(.is-named)').first();
    const itsName = await without.textContent();
    await without.hover();
    assert.deepEqual((await boxes()).map((b) => b.name), [itsName], 'the one under the pointer says its own');
    await page.locator('.stage').press('Escape');
    await page.locator('.stage').press('h');
    await settled(tab, { spp: 1 });
});

test('all are dimmed, coloured and switched in one step each, and what differs says mixed', async () => {
    await name('bulb-1').click();
    await name('bulb-3').click({ modifiers: ['Shift'] });
    assert.equal(await inPanel('Intensity').inputValue(), '');
    assert.equal(await inPanel('Intensity').getAttribute('aria-valuetext'), 'mixed');
    assert.equal(await inPanel('Dim').inputValue(), '100');
    const halved = await oneStep(() => type('Dim', '50'), fluxes);
    assert.deepEqual([halved.before, halved.after], [['100lm', '200lm', '300lm', '400lm', '500lm', '600lm'], ['50lm', '100lm', '150lm', '400lm', '500lm', '600lm']]);
    assert.deepEqual([await inPanel('Dim').inputValue(), await inPanel('DALI').inputValue()], ['50', '229']);
    await edit(() => type('Intensity', '80 cd'));
    assert.equal(await flux(2), '80cd');
    assert.equal(await inPanel('Intensity').inputValue(), '80', 'it is the same of all');
    await edit(() => type('DALI', '254'));
    await eventually(async () => (await inPanel('Dim').inputValue()) === '100', () => inPanel('Dim').inputValue());
    await oneStep(() => panel().getByRole('switch', { name: 'Selected lamps on' }).press('Enter'), () => page.locator('.light.is-off').count());
    await edit(() => panel().getByRole('switch', { name: 'Selected lamps on' }).press('Enter'));
    const colour = async () => (await row(page, 'bulb-2').locator('.lamp-switch').getAttribute('style')) ?? '';
    await oneStep(() => panel().getByRole('button', { name: 'Daylight' }).press('Enter'), colour);
    await edit(() => panel().getByRole('button', { name: 'xy', exact: true }).press('Enter'));
    await edit(() => type('x', '0.45'));
    await edit(() => type('y', '0.41'));
    assert.deepEqual([await inPanel('x').inputValue(), await inPanel('y').inputValue()], ['0.45', '0.41']);
    assert.deepEqual(await violations(page), []);
});

test('dimming and colouring by these numbers traces no ray', async () => {
    await page.getByLabel('Method').selectOption('tic');
    await settled(tab, { spp: 1 });
    for (const [label, text] of [['Dim', '40'], ['x', '0.4'], ['DALI', '200']]) {
        const from = tab.watch.stats.length;
        const rev = await shownRev(page);
        await type(label, text);
        await settled(tab, { rev: rev + 1, spp: 1 });
        await eventually(() => Promise.resolve(tab.watch.stats.slice(from).some((s) => s.scene_rev > rev)), () => 'no statistics of the edit');
        const frames = tab.watch.stats.slice(from).filter((s) => s.scene_rev > rev);
        const first = frames[0];
        assert.deepEqual(Object.entries(first.rays).filter(([kind, n]) => n > 0 && kind !== 'probe'), [], `${label} ${text}: ${JSON.stringify(first.rays)}`);
    }
    await page.getByLabel('Method').selectOption('live');
    await settled(tab, { spp: 1 });
});

test('positions and angles typed for all keep what they do not name; lamps are aligned, spread and put into tiles', async () => {
    await name('bulb-4').click();
    await name('bulb-6').click({ modifiers: ['Shift'] });
    const xs = async () => (await Promise.all([4, 5, 6].map((i) => positionOf(`bulb-${i}`)))).map((p) => p[0]);
    const positionOf = (id) => page.evaluate((one) => {
        const mark = [...document.querySelectorAll('.lamp')].find((m) => m.textContent === one);
        return /translate\(([-\d.]+) ([-\d.]+)\)/.exec(mark.getAttribute('transform')).slice(1).map(Number);
    }, id);
    const even = await oneStep(() => panel().getByRole('button', { name: 'Even gaps X' }).press('Enter'), xs);
    assert.ok(Math.abs(even.after[1] - (even.after[0] + even.after[2]) / 2) < 0.6, `${even.after}`);
    await oneStep(() => type('Z', '80 cm'), async () => inPanel('Z').inputValue());
    assert.equal(await inPanel('Z').inputValue(), '0.8');
    assert.equal(await inPanel('X').getAttribute('placeholder'), 'mixed');
    await edit(() => type('Tilt', '30'));
    assert.equal(await inPanel('Tilt').inputValue(), '30');
    await edit(() => panel().getByRole('button', { name: 'Into tiles' }).press('Enter'));
    assert.match(await said(), /^In the middles of 3 tiles/);
    // Rows of tiles over 4 m: six, in steps from the middle.
    const z = Number(await inPanel('Z').inputValue());
    assert.ok(Math.abs(z / 0.6 - 0.5 - Math.round(z / 0.6 - 0.5)) < 0.01, `z ${z}`);
    await edit(() => panel().getByRole('button', { name: 'Align X' }).press('Enter'));
    assert.notEqual(await inPanel('X').inputValue(), '', 'one number for all');
});

test('100 % is what each was when it joined, whatever joined or left since', async () => {
    await page.locator('.stage').press('Escape');
    await name('bulb-4').click();
    await edit(async () => {
        await field(page, 'bulb-4', 'Dim').fill('50');
        await page.keyboard.press('Enter');
    });
    await name('bulb-5').click({ modifiers: ['Control'] });
    await heading('2 lamps selected');
    assert.equal(await inPanel('Dim').inputValue(), '', 'one is dimmed, and one is not');
    await edit(() => type('Dim', '50'));
    await name('bulb-6').click({ modifiers: ['Control'] });
    await heading('3 lamps selected');
    await edit(() => type('Dim', '100'));
    assert.deepEqual((await fluxes()).slice(3), ['400lm', '500lm', '600lm']);
    await page.locator('.stage').press('Escape');
});

test('the panel comes and goes, and no line of the list moves; one that it would cover comes into sight', async () => {
    const tops = () => page.locator('.light').evaluateAll((lines) => lines.map((l) => l.getBoundingClientRect().top));
    await page.locator('.stage').press('Escape');
    await panel().waitFor({ state: 'detached' });
    await name('bulb-1').focus();
    const before = await tops();
    await page.keyboard.press('Control+a');
    await heading('6 lamps selected');
    assert.deepEqual(await tops(), before);
    await page.locator('.stage').press('Escape');
    await panel().waitFor({ state: 'detached' });
    assert.deepEqual(await tops(), before);
    await name('bulb-6').focus();
    await page.keyboard.press('Control+a');
    await heading('6 lamps selected');
    const line = await name('bulb-6').boundingBox();
    assert.ok(line.y + line.height <= (await panel().boundingBox()).y + 0.5, 'the line that has the focus is not covered');
    await page.locator('.stage').press('Escape');
});

test('the focus stays at Copy, which is of the copies then; from what is of those before it goes to what was made', async () => {
    const title = () => page.evaluate(() => document.activeElement.textContent.trim());
    await page.locator('.stage').press('Escape');
    await name('bulb-1').click();
    await name('bulb-2').click({ modifiers: ['Control'] });
    await heading('2 lamps selected');
    const ids = () => page.locator('.lamp.is-selected').evaluateAll((marks) => marks.map((m) => m.textContent).sort());
    const first = await ids();
    await edit(() => panel().getByRole('button', { name: 'Copy' }).press('Enter'));
    await eventually(async () => (await said()) === 'Copied as 2 more, and selected them', said);
    const second = await ids();
    assert.deepEqual([await title(), second.some((id) => first.includes(id))], ['Copy', false]);
    await edit(() => panel().getByRole('button', { name: 'Align X' }).press('Control+d'));
    await eventually(async () => (await title()) === '2 lamps selected', title);
    assert.ok(!(await ids()).some((id) => [...first, ...second].includes(id)));
    for (let i = 0; i < 2; i++) await edit(() => page.locator('.stage').press('z'));
    await page.locator('.stage').press('Escape');
});

test('they are grouped, copied and removed as one, with a way back', async () => {
    await page.locator('.stage').press('Escape');
    await name('bulb-4').click();
    await name('bulb-6').click({ modifiers: ['Shift'] });
    await heading('3 lamps selected');
    const count = async () => Number(await page.locator('.lights .count').first().innerText());
    await oneStep(async () => {
        await panel().getByLabel('Selected lamps group').fill('row');
        await page.keyboard.press('Enter');
    }, () => page.locator('.light-group').count());
    await page.getByRole('switch', { name: 'Group row on' }).waitFor();
    const copied = await oneStep(() => page.locator('.stage').press('Control+d'), count);
    assert.deepEqual([copied.before, copied.after], [6, 9]);
    for (const close of [() => panel().getByRole('button', { name: 'Select nothing' }).press('Enter'), () => panel().getByRole('button', { name: 'Remove what is selected' }).press('Escape')]) {
        await page.locator('.stage').press('Escape');
        await page.locator('.light-group-head .light-name').click({ modifiers: ['Control'] });
        await heading('6 lamps selected');
        await close();
        await panel().waitFor({ state: 'detached' });
        assert.equal(await page.evaluate(() => document.activeElement.matches('.stage')), true, 'the focus does not fall to the page');
    }
    await page.locator('.light-group-head .light-name').click({ modifiers: ['Control'] });
    await heading('6 lamps selected');
    const removed = await oneStep(() => page.locator('.stage').press('Delete'), count);
    assert.deepEqual([removed.before, removed.after], [9, 3]);
    await page.locator('.stage').press('z');
    await eventually(async () => (await count()) === 9, count);
    await name('bulb-1').click();
    await name('bulb-2').click({ modifiers: ['Control'] });
    await name('bulb-2').press('Delete');
    await eventually(async () => (await count()) === 7, count);
    await eventually(() => page.evaluate(() => document.activeElement.matches('.light-name')), () => page.evaluate(() => document.activeElement.outerHTML.slice(0, 200)));
    await page.locator('.stage').press('z');
    await eventually(async () => (await count()) === 9, count);
});

test('a hand on one of them moves all; with Ctrl, or the switch, it stops at the grid', async () => {
    await page.locator('.stage').press('Escape');
    await name('bulb-1').click();
    await name('bulb-2').click({ modifiers: ['Control'] });
    await heading('2 lamps selected');
    const handle = page.getByRole('button', { name: /^Lamp bulb-2:/ });
    const from = await centre(handle.locator('.handle-hit'));
    const places = async () => [await inPanel('Y').inputValue(), await inPanel('X').inputValue()];
    await oneStep(() => drag(page, from, { x: from.x, y: from.y + 20 }), places);
    const free = Number(await inPanel('Y').inputValue());
    assert.ok(free < 2.45, `both at ${free}`);
    await page.locator('.stage').press('x');
    assert.equal(await page.getByRole('button', { name: 'Snapping (X)' }).getAttribute('aria-pressed'), 'true');
    const now = await centre(handle.locator('.handle-hit'));
    await edit(() => drag(page, now, { x: now.x, y: now.y + 33 }));
    const snapped = Number(await inPanel('Y').inputValue());
    assert.ok(snapped < free && Math.abs(snapped * 10 - Math.round(snapped * 10)) < 1e-6, `${free}, then ${snapped}`);
    await handle.focus();
    await edit(() => page.keyboard.press('ArrowDown'));
    assert.ok(Math.abs(Number(await inPanel('Y').inputValue()) - (snapped - 0.1)) < 1e-6, 'a key goes one step');
    await page.getByLabel('Snap to', { exact: true }).fill('25 cm');
    await page.keyboard.press('Enter');
    await handle.focus();
    await edit(() => page.keyboard.press('ArrowUp'));
    const up = Number(await inPanel('Y').inputValue());
    assert.ok(Math.abs(up * 4 - Math.round(up * 4)) < 1e-6 && up > snapped - 0.1, `${up}`);
    await page.locator('.stage').press('x');
});

test('an aim is dragged by its handle, and stops at angles', async () => {
    await select(page, 'bulb-3');
    const aim = page.getByRole('button', { name: /^Aim of bulb-3/ });
    const from = await centre(aim.locator('.handle-hit'));
    await page.keyboard.down('Control');
    await edit(() => drag(page, from, { x: from.x - 30, y: from.y - 8 }));
    await page.keyboard.up('Control');
    const [tilt, turn] = await numbers('bulb-3', 'Tilt', 'Turn');
    assert.ok(tilt > 0 && tilt % 15 === 0 && turn % 15 === 0, `${tilt} ${turn}`);
    await aim.focus();
    await edit(() => page.keyboard.press('Control+ArrowLeft'));
    const after = await numbers('bulb-3', 'Tilt', 'Turn');
    assert.ok(after[0] % 15 === 0 && (after[0] !== tilt || after[1] !== turn), `${after}`);
    await edit(() => page.locator('.stage').press('z'));
    assert.deepEqual(await violations(page), []);
    await field(page, 'bulb-3', 'Tilt').waitFor();
});

test('nothing was written to the console as an error', () => assert.deepEqual(tab.watch.errors, []));
