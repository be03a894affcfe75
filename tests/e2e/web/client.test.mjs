// The whole way: a real daemon, a real browser, pixels. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { centre, difference, drag, eventually, field, measure, open, row, select, settled, shownRev, thumbnail } from './browser.mjs';
import { ROOM, context, edit, page, roomOps, serve, tab, withScene } from './stage.mjs';

const daemon = serve(ROOM);
/** A pixel of 8 path-traced samples is off by about a half (relative standard deviation, measured); the mean over the 5 600
 * pixels of the wall by 0.7 %, a ratio of two by 1 %. Rounding to 8 bits adds 0.6 % at most. Three of that: 5 %. */
const SAMPLES = 8;
const TOLERANCE = 0.05;

const intensity = (p, id) => p.getByLabel(`${id} intensity`);

test('the address opens the scene, and the token leaves the address bar', async () => {
    assert.equal(new URL(page.url()).hash, '');
    const { mean, colours } = await measure(page);
    assert.ok(mean > 0.005 && mean < 0.9, `mean luminance ${mean}`);
    assert.ok(colours > 1000, `${colours} colours`);
    assert.equal(await row(page, 'ceiling-panel').count(), 1);
    tab.watch.sentSeq = 0; // the new page counts from the start: what the old one sent is nothing to wait for
    await page.reload();
    await settled(tab); // the token is kept for this tab
});

test('dragging orbits: other pixels, and the camera comes back with the frame', async () => {
    const start = await thumbnail(page);
    const first = tab.watch.sentSeq;
    const c = await centre(page.locator('.stage'));
    await drag(page, { x: c.x, y: c.y + 80 }, { x: c.x + 120, y: c.y + 120 });
    await settled(tab);
    assert.ok(tab.watch.sentSeq > first, 'a camera was sent');
    assert.equal(tab.watch.shownSeq, tab.watch.sentSeq, 'the frame on the wire echoes the newest camera');
    const turned = difference(start, await thumbnail(page));
    assert.ok(turned > 8, `rms difference ${turned}`);
    await page.locator('.stage').focus();
    await page.keyboard.press('h');
    await settled(tab);
    const back = difference(start, await thumbnail(page));
    assert.ok(back < 0.5 * turned, `H brings the view back: rms difference ${back} after ${turned}`);
});

test('halving a light halves what it lights', async () => {
    // No tone curve, dark enough that nothing on the wall clips: what is shown is proportional to luminance.
    await page.getByLabel('Tone map').selectOption('none');
    await edit(() => field(page, 'accent', 'accent on').click());
    for (let i = 0; i < 3; i++) await page.keyboard.press('[');
    await select(page, 'ceiling-panel');
    const wall = [0.35, 0.2, 0.65, 0.5];
    await settled(tab, { spp: SAMPLES });
    const full = (await measure(page, wall)).mean;
    await edit(async () => {
        await field(page, 'ceiling-panel', 'Intensity').fill('4500');
        await page.keyboard.press('Enter');
    }, SAMPLES);
    const half = (await measure(page, wall)).mean;
    assert.ok(Math.abs(half / full - 0.5) < TOLERANCE, `${half} / ${full} = ${half / full}`);
    await edit(() => page.locator('.stage').press('z'), SAMPLES);
    const again = (await measure(page, wall)).mean;
    assert.ok(Math.abs(again / full - 1) < TOLERANCE, `after undo ${again}, before ${full}`);
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await field(page, 'accent', 'accent on').getAttribute('aria-checked'), 'true');
    await page.getByLabel('Tone map').selectOption('agx');
});

test('a slider dims by pointer and by keys, and one undo takes a whole drag back', async () => {
    const slider = intensity(page, 'ceiling-panel');
    await settled(tab);
    const before = (await measure(page)).mean;
    const value = await slider.getAttribute('aria-valuetext');
    const box = await slider.boundingBox();
    const y = box.y + box.height / 2;
    const at = async () => box.x + 7 + (box.width - 14) * Number(await slider.inputValue());
    await edit(async () => drag(page, { x: await at(), y }, { x: box.x + 0.5 * box.width, y }, 20));
    const dimmed = (await measure(page)).mean;
    assert.ok(dimmed < 0.8 * before, `mean ${dimmed} after dimming, ${before} before`);
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await slider.getAttribute('aria-valuetext'), value);
    await slider.focus();
    await edit(() => page.keyboard.press('Home'));
    assert.equal(await slider.getAttribute('aria-valuetext'), '0 lumens');
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await slider.getAttribute('aria-valuetext'), value);
});

test('a lamp is dragged in the picture, and put back by one undo', async () => {
    await select(page, 'accent');
    await settled(tab);
    const marker = page.getByRole('button', { name: 'Lamp accent' });
    const position = async () =>
        Promise.all(['X', 'Y', 'Z'].map(async (axis) => Number(await field(page, 'accent', axis).inputValue())));
    const start = await position();
    const before = await thumbnail(page);
    const c = await centre(marker);
    await edit(() => drag(page, c, { x: c.x - 180, y: c.y + 60 }, 12));
    const moved = await position();
    assert.ok(moved[0] < start[0] - 0.3 && moved[1] < start[1] - 0.1, `from ${start} to ${moved}`);
    const at = await centre(marker);
    assert.ok(Math.hypot(at.x - (c.x - 180), at.y - (c.y + 60)) < 3, 'the marker is where it was let go');
    const changed = difference(before, await thumbnail(page));
    assert.ok(changed > 2, `the light falls elsewhere: rms difference ${changed}`);
    await edit(() => page.locator('.stage').press('z'));
    assert.deepEqual(await position(), start);
    await edit(() => page.locator('.stage').press('Shift+Z'));
    assert.deepEqual(await position(), moved);
    await edit(() => page.locator('.stage').press('z'));
});

test('a clicked object is dragged by its mark, moved by the keys, and put back by one undo', async () => {
    const card = page.getByRole('complementary', { name: 'Picked point' });
    const mark = page.getByRole('button', { name: 'block: drag' });
    const point = async () => (await card.locator('dd').first().textContent()).split(/[, ]+/).slice(0, 3).map(Number);
    const stage = await page.locator('.stage').boundingBox();
    const c = { x: stage.x + 0.4 * stage.width, y: stage.y + 0.7 * stage.height };
    await settled(tab);
    const before = await thumbnail(page);
    await page.mouse.click(c.x, c.y);
    await mark.waitFor();
    const start = await point();
    await edit(() => drag(page, c, { x: c.x + 120, y: c.y - 40 }, 12));
    const moved = await point();
    assert.ok(moved[0] > start[0] + 0.3 && moved[1] > start[1] + 0.1, `from ${start} to ${moved}`);
    const at = await centre(mark);
    assert.ok(Math.hypot(at.x - (c.x + 120), at.y - (c.y - 40)) < 3, 'the mark is where it was let go');
    assert.ok(difference(before, await thumbnail(page)) > 4, 'the object is elsewhere in the picture');
    await edit(() => page.locator('.stage').press('z'));
    assert.deepEqual(await point(), start);
    await mark.focus();
    await edit(() => page.keyboard.press('Shift+ArrowDown'));
    const nearer = await point();
    assert.ok(nearer[2] > start[2] && nearer[1] === start[1], `over the floor from ${start} to ${nearer}`);
    await edit(() => page.locator('.stage').press('z'));
    const first = tab.watch.sentSeq;
    await page.mouse.move(c.x, c.y);
    await page.mouse.wheel(0, 120);
    await settled(tab);
    assert.ok(tab.watch.sentSeq > first, 'over the mark the wheel still moves the camera');
    await page.locator('.stage').press('h');
    await page.keyboard.press('Escape');
    await settled(tab);
});

test('a click says what is there and how bright it is', async () => {
    const c = await centre(page.locator('.stage'));
    await page.mouse.click(c.x, c.y + 250);
    const card = page.getByRole('complementary', { name: 'Picked point' });
    await card.locator('b', { hasText: /\w/ }).waitFor();
    const lux = async () => Number((await card.locator('.reading-lux').textContent()).split('lx')[0].replace(/[^\d.]/g, ''));
    await eventually(async () => (await lux()) > 0, () => 'no illuminance');
    const lit = await lux();
    await edit(() => field(page, 'ceiling-panel', 'ceiling-panel on').click());
    await eventually(async () => (await lux()) < 0.7 * lit, () => `the meter stays at ${lit} lx`);
    await edit(() => page.locator('.stage').press('z'));
    await page.keyboard.press('Escape');
    assert.equal(await card.count(), 0);
});

test('solo shows one light in this view alone, until the page is left', async () => {
    const solo = page.getByLabel('Solo accent');
    const on = (id) => field(page, id, `${id} on`).getAttribute('aria-checked');
    const other = await open(context, daemon.url);
    await settled(other);
    const theirs = await thumbnail(other.page);
    const rev = await shownRev(page);
    await settled(tab);
    const lit = (await measure(page)).mean;
    await solo.click();
    await settled(tab);
    assert.ok((await measure(page)).mean < 0.7 * lit, 'the panel is dark here');
    assert.deepEqual([await on('ceiling-panel'), await on('accent'), await solo.getAttribute('aria-pressed')], ['true', 'true', 'true']);
    assert.equal(await shownRev(page), rev, 'no edit was made');
    assert.ok(difference(theirs, await thumbnail(other.page)) < 4, 'the others see all lamps');
    tab.watch.sentSeq = 0;
    await page.reload();
    await settled(tab);
    assert.equal(await page.getByLabel('Solo accent').getAttribute('aria-pressed'), 'false');
    const whole = (await measure(page)).mean; // the exposure of this view is gone with the page, too
    await page.getByLabel('Solo accent').click();
    await settled(tab);
    assert.ok((await measure(page)).mean < 0.7 * whole);
    await page.getByRole('button', { name: 'Show all' }).click();
    await settled(tab);
    assert.ok(Math.abs((await measure(page)).mean / whole - 1) < 0.1, 'as before');
    await other.page.close();
});

test('two tabs see each other’s edits, with cameras of their own', async () => {
    const other = await open(context, daemon.url);
    await other.page.getByLabel('Resolution').selectOption('fast');
    await settled(other);
    await other.page.locator('.stage').press('ArrowRight');
    await settled(other);
    const still = await thumbnail(page);
    const mean = (await measure(other.page)).mean;
    await select(page, 'ceiling-panel');
    await field(page, 'ceiling-panel', 'Intensity').fill('2500');
    await page.keyboard.press('Enter');
    await settled(tab, { rev: (await shownRev(page)) + 1 });
    await settled(other, { rev: await shownRev(page) });
    assert.equal(await intensity(other.page, 'ceiling-panel').getAttribute('aria-valuetext'), '2\u2009500 lumens');
    assert.ok((await measure(other.page)).mean < 0.8 * mean, 'darker in the other tab too');
    assert.ok(difference(still, await thumbnail(page)) > 4);
    // Undo is each user's own.
    await other.page.locator('.stage').press('z');
    await other.page.getByText('nothing to undo').waitFor();
    await edit(() => page.locator('.stage').press('z'));
    assert.deepEqual(other.watch.errors, []);
    await other.page.close();
});

const model = (id) => page.locator('.model', { has: page.locator('.light-name', { hasText: id }) });
const importAs = async (file) => {
    await page.getByLabel('Model file below').fill(file);
    await page.getByRole('button', { name: 'Import', exact: true }).click();
};

test('a model is imported, looked at, moved as a whole, and taken away again', async () => {
    await edit(() => importAs('lamp.gltf'));
    const notice = page.locator('.toast', { hasText: 'Imported lamp.gltf as lamp' });
    const start = await thumbnail(page);
    await notice.getByRole('button', { name: 'Look at it' }).click();
    await eventually(async () => difference(start, await thumbnail(page)) > 8, () => 'the camera stays');
    assert.equal(await notice.count(), 0);
    await select(page, 'lamp/bulb');
    const height = () => field(page, 'lamp/bulb', 'Y').inputValue();
    assert.equal(await height(), '0.9');
    const before = await thumbnail(page);
    await edit(async () => {
        await model('lamp').getByLabel('Y', { exact: true }).fill('0.25');
        await page.keyboard.press('Enter');
    });
    assert.equal(await height(), '1.15', 'its lamp moves along');
    assert.ok(difference(before, await thumbnail(page)) > 4, 'and so does what is seen of it');
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await height(), '0.9');
    await edit(() => model('lamp').getByLabel('Remove lamp').click());
    await row(page, 'lamp/bulb').waitFor({ state: 'detached' });
    await edit(() => importAs('lamp.gltf'));
    await edit(() => notice.getByRole('button', { name: 'Undo' }).click());
    await row(page, 'lamp/bulb').waitFor({ state: 'detached' });
    await page.locator('.stage').press('h');
    await settled(tab);
});

test('a click on any part of a model selects it', async () => {
    await edit(() => importAs('lamp.gltf'));
    await page.locator('.toast', { hasText: 'Imported lamp.gltf' }).getByLabel('Dismiss').click();
    await page.keyboard.press('Escape');
    await model('lamp').getByLabel('Scale').waitFor({ state: 'detached' });
    const start = await thumbnail(page);
    await page.getByLabel('Look at lamp', { exact: true }).click();
    await eventually(async () => difference(start, await thumbnail(page)) > 8, () => 'the camera stays');
    await settled(tab);
    const c = await centre(page.locator('.stage'));
    await page.mouse.click(c.x, c.y);
    await model('lamp').getByLabel('Scale').waitFor();
    const x = () => model('lamp').getByLabel('X', { exact: true }).inputValue();
    const placed = await x();
    await edit(() => page.getByRole('button', { name: 'lamp: drag' }).press('ArrowRight'));
    assert.notEqual(await x(), placed, 'its mark moves the whole model');
    await edit(() => model('lamp').getByLabel('Remove lamp').click());
    await page.locator('.stage').press('h');
    await page.keyboard.press('Escape');
    await settled(tab);
});

test('an import that fails says why and what to do, until the next try', async () => {
    const problem = page.locator('.problem');
    const nasty = '<img src=x onerror="window.hacked=1">.glb';
    await importAs(nasty);
    await problem.getByText('no “<img').waitFor();
    assert.ok(!/ops\//.test(await problem.textContent()));
    assert.equal(await problem.locator('img').count(), 0);
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    await importAs('room.jsonl');
    await problem.getByText('plain glTF').waitFor();
    await page.getByLabel('Model file below').fill('');
    assert.equal(await problem.count(), 0);
});

test('a number that cannot be is refused with the reason beside it', async () => {
    await select(page, 'ceiling-panel');
    const intensity = field(page, 'ceiling-panel', 'Intensity');
    const was = await intensity.inputValue();
    for (const bad of ['-5', '', '1e13']) {
        await intensity.fill(bad);
        await page.keyboard.press('Enter');
        await row(page, 'ceiling-panel').getByText('Not changed: needs a number from 0 to 10¹² lm').waitFor();
        assert.equal(await intensity.inputValue(), was);
    }
    await intensity.fill(was);
    assert.equal(await page.locator('.number-reason', { hasText: /./ }).count(), 0);
});

test('a view opens balanced for its lamps, most of the way; white balance takes the colour out of the light, and of no map', async () => {
    await settled(tab);
    const off = page.getByLabel('White balance off');
    assert.equal(await off.getAttribute('aria-pressed'), 'false');
    const opened = tab.watch.sent.findLast((m) => m.method === 'view.open').params.white_balance_k;
    await page.getByRole('combobox', { name: 'Map', exact: true }).selectOption('luminance');
    await settled(tab, { spp: SAMPLES });
    const map = await thumbnail(page);
    await off.click();
    await settled(tab, { spp: SAMPLES });
    assert.ok(difference(map, await thumbnail(page)) < 3, 'false colour is of light, and not of how it is seen');
    await page.getByRole('combobox', { name: 'Map', exact: true }).selectOption('none');
    await settled(tab);
    const blue = async () => (await thumbnail(page)).reduce((sum, v, i) => sum + (i % 4 === 2 ? v : i % 4 === 0 ? -v : 0), 0);
    const warm = await blue();
    const plain = await thumbnail(page);
    await off.click(); // to the lamps', all the way
    await settled(tab);
    const lamps = tab.watch.sent.findLast((m) => m.params?.white_balance_k).params.white_balance_k;
    assert.ok(opened > lamps && opened < 6504, `${opened} K, and the lamps ${lamps} K`);
    assert.ok((await blue()) > warm + 64 * 48 * 10, 'bluer by more than ten steps of 255');
    await off.click();
    await settled(tab);
    assert.ok(difference(plain, await thumbnail(page)) < 3);
});

const effect = (name) => page.locator('.effect', { has: page.locator('th', { hasText: name }) });
const rays = (name) => effect(name).locator('.effect-rays').textContent();

test('the effect table says what is needed and why; what is switched off costs nothing', async () => {
    await page.getByLabel('Method').selectOption('whitted');
    await settled(tab);
    await effect('soft shadow').getByText('ceiling-panel shines from an area').waitFor();
    await eventually(async () => !/^0/.test(await rays('soft shadow')), () => 'no ray for soft shadows');
    assert.equal(await rays('media'), '0 rays');
    assert.match(await effect('media').getAttribute('class'), /is-off/);
    assert.match(await effect('media').textContent(), /no medium/);
    const lit = (await measure(page)).mean;
    const off = page.getByRole('button', { name: 'soft shadow off' });
    await off.click();
    await settled(tab);
    await effect('soft shadow').getByText('switched it off').waitFor();
    assert.equal(await off.getAttribute('aria-pressed'), 'true');
    assert.equal(await rays('soft shadow'), '0 rays');
    const dark = (await measure(page)).mean;
    assert.ok(dark < 0.6 * lit, `mean ${dark} without the panel, ${lit} with it`);
    await page.getByRole('button', { name: 'All automatic' }).click();
    await settled(tab);
    await effect('soft shadow').getByText('ceiling-panel shines').waitFor();
    const again = (await measure(page)).mean;
    assert.ok(Math.abs(again / lit - 1) < 0.01, `mean ${again} after ${lit}`);
});

test('the noise of each effect stands beside its cost, where samples tell it', async () => {
    const column = page.locator('.effects thead').getByText('Noise');
    assert.equal(await column.count(), 0, 'whitted has no samples');
    await page.getByLabel('Method').selectOption('path');
    await settled(tab, { spp: 4 });
    await column.waitFor();
    const noise = (name) => effect(name).locator('tr').first().locator('td').last().textContent();
    await eventually(async () => /^[\d.]+ %$/.test(await noise('indirect diffuse')), () => noise('indirect diffuse'));
    assert.equal(await noise('media'), '–');
    assert.equal(await effect('indirect diffuse').locator('.effect-share').count(), 2);
    assert.equal(await effect('media').locator('.effect-share').count(), 0);
    await page.getByLabel('Method').selectOption('whitted');
    await settled(tab);
});

test('an empty picture says why, and H is the way back', async () => {
    const notice = page.locator('.banner-empty');
    assert.equal(await notice.count(), 0);
    for (const id of ['ceiling-panel', 'accent']) await edit(() => field(page, id, `${id} on`).click());
    await notice.getByText('All lights are off').waitFor();
    for (let i = 0; i < 2; i++) await edit(() => page.locator('.stage').press('z'));
    await notice.waitFor({ state: 'detached' });
    const stage = await centre(page.locator('.stage'));
    await page.keyboard.down('Shift');
    for (let i = 0; i < 3; i++) await drag(page, { x: stage.x - 200, y: stage.y }, { x: stage.x + 300, y: stage.y });
    await page.keyboard.up('Shift');
    await settled(tab);
    await notice.getByText('Nothing in view').waitFor();
    await notice.getByRole('button', { name: 'Go there' }).click();
    await settled(tab);
    await notice.waitFor({ state: 'detached' });
    assert.ok((await measure(page)).colours > 1000);
});

test('a scene without light says so, and gets a lamp', async () => {
    const dark = roomOps().filter((line) => !line.includes('"light"'));
    await withScene(dark, null, async (other) => {
        const notice = other.page.locator('.banner-empty');
        await notice.getByText('The scene has no light').waitFor();
        await eventually(async () => (await measure(other.page)).colours > 2, () => 'no shapes are shown in the dark');
        assert.equal(await other.page.getByRole('combobox', { name: 'Map', exact: true }).inputValue(), 'shapes');
        await other.page.getByText('Or send files: drop them onto the page').waitFor();
        assert.equal(await other.page.getByRole('button', { name: 'Import' }).count(), 0);
        await notice.getByRole('button', { name: 'Add a lamp' }).click();
        await notice.waitFor({ state: 'detached' });
        await settled(other, { rev: 2 });
        const { mean } = await measure(other.page);
        assert.ok(mean > 0.005, `mean luminance ${mean}`);
        assert.equal(await other.page.getByRole('combobox', { name: 'Map', exact: true }).inputValue(), 'none');
        await other.page.getByRole('button', { name: 'Lamp bulb' }).waitFor();
    });
});

test('light that a mirror sends where no method shows it is told with its amount, and what to do', async () => {
    const room = roomOps();
    const mirror = [
        '{"op":"add","type":"material","id":"silver","metallic":1,"roughness":0}',
        '{"op":"add","type":"mesh","id":"sheet","shape":"quad","size":[1,0,1]}',
        '{"op":"add","type":"object","id":"hand-mirror","mesh":"sheet","material":"silver","transform":{"translate":[1,0.5,0.6]}}',
    ];
    await withScene([...room, ...mirror], null, async (other) => {
        const notice = other.page.locator('.missing', { hasText: 'of the light of accent is in no picture' });
        await notice.waitFor();
        assert.match(await notice.textContent(), /^\d+(\.\d)? % .* \(above all hand-mirror\)$/);
        assert.match(await notice.getAttribute('title'), /a sphere, disc or quad in its place/);
        await field(other.page, 'accent', 'accent on').click();
        await notice.waitFor({ state: 'detached' });
    });
});

test('a scene without objects says how to get some', async () => {
    const empty = ['{"op": "add", "type": "camera", "id": "main", "position": [0, 1, 5], "target": [0, 1, 0]}'];
    await withScene(empty, null, (other) => other.page.getByText('drop a model’s file onto this page').waitFor());
});

test('the status line holds everything, whole, in as many lines as it takes', async () => {
    for (const width of [1400, 1000, 700, 390]) {
        await page.setViewportSize({ width, height: 640 });
        const shown = await page.evaluate(() => {
            const bar = document.querySelector('.status').getBoundingClientRect();
            const parts = [...document.querySelector('.status').children].map((e) => [e.className, e.getBoundingClientRect()]);
            const inside = parts.filter(([, b]) => b.width > 0 && b.bottom <= Math.min(bar.bottom, innerHeight) + 0.5);
            return { parts: inside.map(([name]) => name), cut: inside.filter(([, b]) => b.right > bar.right).map(([name]) => name) };
        });
        assert.deepEqual(shown.cut, [], `${width} pixels wide`);
        assert.equal(shown.parts.filter((name) => name.includes('item-')).length, 10, `${width} pixels wide: ${shown.parts}`);
        assert.equal(shown.parts.includes('sparkline'), width === 1400, `${width} pixels wide: ${shown.parts}`);
    }
    await page.setViewportSize({ width: 1000, height: 640 });
    await settled(tab);
});

test('what the picture was said to be goes with the setting that it had', async () => {
    await settled(tab);
    await page.evaluate(() => {
        window.words = [];
        const text = () => document.querySelector('.quality').textContent;
        const before = text();
        let chosen = false; // other numbers of the line change before that, too
        document.addEventListener('change', () => (chosen = true), { capture: true, once: true });
        const note = () => chosen && (window.words.length > 0 || text() !== before) && window.words.push(text());
        window.observer = new MutationObserver(note);
        window.observer.observe(document.querySelector('.status'), { childList: true, subtree: true, characterData: true });
    });
    await page.getByLabel('Method').selectOption('whitted');
    await settled(tab);
    const words = await page.evaluate(() => (window.observer.disconnect(), window.words));
    assert.equal(words[0], 'updating', `first of ${words.join(' | ')}`);
});

test('the accuracy panel shows how the error falls, and refinement stops where its slider stands', async () => {
    const panel = page.getByRole('region', { name: 'Accuracy' });
    const stop = panel.getByLabel('Stop refining at');
    const points = async () => Number(await panel.getByRole('img').getAttribute('data-points'));
    const newest = () => tab.watch.stats.at(-1);
    const told = () => JSON.stringify({ spp: newest().spp, error: newest().error, stopped_by: newest().stopped_by });
    await page.getByLabel('Method').selectOption('live');
    await settled(tab);
    await panel.getByText(/^At most [\d.]+ % off \(about [\d.]+ %\), 95 % sure\.$/).waitFor();
    await eventually(async () => (await points()) > 3, () => 'no points in the plot');
    assert.match(await panel.getByRole('img').getAttribute('aria-label'), /^Error over time: at most .* after .* s, at most/);

    await stop.focus();
    await page.keyboard.press('Home');
    assert.match(await stop.getAttribute('aria-valuetext'), /^fast, reached .* after the picture began$/);
    await eventually(async () => newest().converged && newest().stopped_by === 'error', told);
    const { spp } = newest();
    const before = await points();
    await page.keyboard.press('End');
    assert.match(await stop.getAttribute('aria-valuetext'), /^exact, /);
    await eventually(async () => newest().spp > spp, told);
    assert.ok((await points()) >= before, 'it is the same picture');
    await page.locator('.stage').press(',');
    assert.match(await stop.getAttribute('aria-valuetext'), /^0\.5 % error, /);
    for (let i = 0; i < 4; i++) await stop.press('ArrowLeft');
    assert.match(await stop.getAttribute('aria-valuetext'), /^10 % error, /);
    await eventually(async () => newest().converged && newest().stopped_by === 'error' && newest().error.bound <= 0.1, told);
    await panel.getByText(/^10 % was reached after /).waitFor();
    assert.deepEqual(tab.watch.errors, []);
});

test('a method that adds no samples says so, and how far it is off', async () => {
    const panel = page.getByRole('region', { name: 'Accuracy' });
    const stop = panel.getByLabel('Stop refining at');
    await page.getByLabel('Method').selectOption('whitted');
    await settled(tab);
    assert.ok(await stop.isDisabled());
    await panel.getByText('whitted makes its picture in one pass').waitFor();
    await panel.getByText(/^At most [\d.]+ % off/).waitFor();
    await eventually(async () => tab.watch.stats.at(-1).stopped_by === 'whole', () => tab.watch.stats.at(-1).stopped_by);
    await page.getByLabel('Method').selectOption('path');
    await settled(tab);
    await stop.press('End');
    assert.deepEqual(tab.watch.errors, []);
});

test('ais is chosen, and shows where it refined', async () => {
    const legend = page.getByRole('complementary', { name: 'Legend' });
    await page.getByLabel('Method').selectOption('ais');
    await settled(tab);
    await eventually(async () => !/^0/.test(await rays('indirect diffuse')), () => 'no ray for indirect light');
    assert.ok((await measure(page)).colours > 1000);
    await page.getByLabel(/^Map/).selectOption('guidance_soft_shadow');
    await legend.getByText('How often samples').waitFor();
    await settled(tab);
    const blueOrRed = async () => {
        const p = await thumbnail(page);
        let n = 0;
        for (let i = 0; i < p.length; i += 4) n += Math.abs(p[i] - p[i + 2]) > 20;
        return n / (p.length / 4);
    };
    assert.ok((await blueOrRed()) > 0.9, `${await blueOrRed()} of the picture is blue or red`);
    await page.getByLabel('Method').selectOption('whitted');
    await legend.getByText('whitted makes no such map').waitFor();
    await settled(tab);
    const without = await thumbnail(page);
    await legend.getByRole('button', { name: 'Hide' }).click();
    await settled(tab);
    assert.ok(difference(without, await thumbnail(page)) < 1, 'the picture as it is');
    await page.getByLabel('Method').selectOption('path');
    await settled(tab);
    assert.equal(await legend.count(), 0);
    await eventually(async () => (await rays('antialias')) === 'with the samples', () => 'antialias of path');
});

test('false colour and the error are laid over the picture by a key, with what their colours stand for', async () => {
    const legend = page.getByRole('complementary', { name: 'Legend' });
    let apart;
    await page.getByLabel('Method').selectOption('whitted'); // a picture that is refined no further
    await settled(tab);
    const plain = await thumbnail(page);
    await page.locator('canvas').first().focus();
    await page.keyboard.press('c');
    await legend.getByText('cd/m²', { exact: true }).waitFor();
    await settled(tab);
    const { overlay } = tab.watch.stats.at(-1);
    assert.equal(await legend.getByRole('listitem').count(), overlay.colors.length);
    assert.ok(overlay.limits.every((limit, i) => i === 0 || limit > overlay.limits[i - 1]), `${overlay.limits}`);
    await eventually(async () => difference(plain, await thumbnail(page)) > 5, () => 'no colours');
    await page.keyboard.press('c');
    await legend.getByText('lx', { exact: true }).waitFor();
    await page.keyboard.press('c');
    await legend.getByText('below 0.5 %').waitFor();
    await page.keyboard.press('c');
    await settled(tab);
    assert.equal(await legend.count(), 0);
    await eventually(async () => (apart = difference(plain, await thumbnail(page))) < 1, () => `${apart} off the picture before`);
    await page.getByLabel('Method').selectOption('path');
    await settled(tab);
    assert.deepEqual(tab.watch.errors, []);
});

test('a surface that shines is a lamp: dimmed from the list without a ray, and put back as in the model', async () => {
    const add = [
        { op: 'add', type: 'mesh', id: 'sheet', shape: 'quad', size: [0.8, 0, 0.8] },
        { op: 'add', type: 'material', id: 'glow', emission_cd_m2: 2000, emission_sides: 'front' },
        { op: 'add', type: 'object', id: 'luminaire', mesh: 'sheet', material: 'glow', transform: { translate: [0.8, 3, 0], rotate_deg: [180, 0, 0] } },
        // A picture that has come to rest: no sample is under way whose rays the next frame would count.
        { op: 'set', id: 'render', path: '/spp', value: SAMPLES },
    ];
    await withScene([...roomOps(), ...add.map((op) => JSON.stringify(op))], null, async (own) => {
        const p = own.page;
        await settled(own, { spp: SAMPLES });
        await select(p, 'luminaire');
        const change = async (action) => {
            const rev = Math.max(...own.watch.stats.map((s) => s.scene_rev));
            await action();
            await settled(own, { rev: rev + 1, spp: SAMPLES });
            return own.watch.stats.find((s) => s.scene_rev > rev);
        };
        const lumens = Math.PI * 2000 * 0.64;
        const shown = async () => Number(await field(p, 'luminaire', 'Intensity').inputValue());
        assert.ok(Math.abs((await shown()) / lumens - 1) < 0.01, `${await shown()} lm, ${lumens} expected`);
        const bright = (await measure(p)).mean;
        const { rays } = await change(async () => {
            await field(p, 'luminaire', 'Intensity').fill('400');
            await p.keyboard.press('Enter');
        });
        assert.deepEqual(Object.entries(rays).filter(([, n]) => n > 0), [], 'rays of the first frame of the dimmed lamp');
        const dim = (await measure(p)).mean;
        assert.ok(dim < 0.95 * bright, `mean ${dim} after dimming, ${bright} before`);
        await change(() => row(p, 'luminaire').getByRole('button', { name: 'As in the model' }).click());
        assert.ok(Math.abs((await shown()) / lumens - 1) < 0.01, `${await shown()} lm again`);
        const again = (await measure(p)).mean;
        assert.ok(Math.abs(again / bright - 1) < TOLERANCE, `mean ${again}, ${bright} before`);
        await change(() => field(p, 'luminaire', 'luminaire on').click());
        assert.equal(await field(p, 'luminaire', 'luminaire on').getAttribute('aria-checked'), 'false');
    });
});

/** Ten panels, two of material `warm` of 2000 cd/m2 and the others of `cold` of 100: groups by material. */
function manyPanels() {
    const sheet = { op: 'add', type: 'mesh', id: 'sheet', shape: 'quad', size: [0.2, 0, 0.2] };
    const glow = (id, emission_cd_m2) => ({ op: 'add', type: 'material', id, emission_cd_m2, emission_sides: 'front' });
    const panel = (id, group, x, fields) => ({
        ...{ op: 'add', type: 'object', id, mesh: 'sheet', material: group, group: `by-${group}`, ...fields },
        transform: { translate: [x, 3, 0], rotate_deg: [180, 0, 0] },
    });
    const cold = [...Array(8).keys()].map((i) => panel(`cold-${i}`, 'cold', 0.3 * i, {}));
    const warm = [panel('warm-a', 'warm', -0.3, {}), panel('warm-b', 'warm', -0.6, { flux_lm: 60 })];
    return [sheet, glow('cold', 100), glow('warm', 2000), ...cold, ...warm].map((op) => JSON.stringify(op));
}

test('many lamps: found by name, and groups of them dimmed as one and put back as in the model', async () => {
    await withScene([...roomOps(), ...manyPanels()], null, async (own) => {
        const p = own.page;
        const filter = p.getByLabel('Filter lights by name');
        await filter.fill('nothing like it');
        await p.getByRole('status').getByText('No lamp matches “nothing like it”.').waitFor();
        assert.equal(await p.locator('.light').count(), 0);
        await p.getByRole('button', { name: 'Clear the filter' }).press('Enter');
        assert.equal(await filter.inputValue(), '');
        assert.ok(await filter.evaluate((e) => e === document.activeElement), 'one can go on typing');
        await row(p, 'warm-a').waitFor();

        const names = await p.locator('.light-group-head .light-name').evaluateAll((all) => all.map((e) => e.title));
        assert.deepEqual(names, ['by-warm', 'by-cold'], 'by the light that they give');
        const lumens = async (id) => {
            await select(p, id);
            return Number(await field(p, id, 'Intensity').inputValue());
        };
        const model = Math.PI * 2000 * 0.04;
        const near = (got, want, what) => assert.ok(Math.abs(got / want - 1) < 1e-4, `${what}: ${got} lm, ${want} expected`);
        near(await lumens('warm-a'), model, 'warm-a at first');
        const dimmer = p.getByLabel('Group by-warm intensity');
        await dimmer.focus();
        await dimmer.press('PageDown');
        const rev = Math.max(...own.watch.stats.map((s) => s.scene_rev));
        await dimmer.press('Home'); // as dark as it goes: the ratios have to survive it
        await settled(own, { rev: rev + 1 });
        assert.match(await dimmer.getAttribute('aria-valuetext'), /^1 lumens in all$/);
        near(await lumens('warm-a'), model / (model + 60), 'warm-a, dimmed');
        near(await lumens('warm-b'), 60 / (model + 60), 'warm-b, dimmed');
        assert.equal(await p.getByRole('button', { name: /^group by-cold: back/ }).count(), 0, 'it is as in the model');
        await p.getByRole('button', { name: /^group by-warm: back to the 502.7 lumens of the model$/ }).press('Enter');
        await p.getByRole('button', { name: /^warm-b: back/ }).waitFor({ state: 'detached' });
        near(await lumens('warm-b'), model, 'warm-b as in the model');
        await p.locator('.stage').press('z');
        await p.locator('.stage').press('z');
        await p.getByRole('button', { name: /^warm-b: back/ }).waitFor();
        await eventually(async () => Math.abs((await lumens('warm-b')) - 60) < 1e-3, () => 'two undos take it back');
    });
});

test('every control has a name', async () => {
    await select(page, 'accent');
    const nameless = await page.evaluate(() =>
        [...document.querySelectorAll('button, input, select, [role=button], [role=application]')]
            .filter((e) => !(e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim()))
            .map((e) => e.outerHTML),
    );
    assert.deepEqual(nameless, []);
});

test('the page comes back by itself when the server does', async () => {
    assert.deepEqual(tab.watch.errors, [], 'errors in the console until here');
    assert.equal(await daemon.stop(), 0);
    await page.locator('.banner').waitFor();
    await daemon.start();
    await page.locator('.banner').waitFor({ state: 'detached' });
    await settled(tab);
    assert.ok((await measure(page)).colours > 1000);
});
