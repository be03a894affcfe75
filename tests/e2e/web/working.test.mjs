// Working in it: lamps put in and taken away, many of them, by keyboard alone, on a bad line, in a hidden tab. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync } from 'node:fs';
import { connect, createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { difference, eventually, field, measure, open, row, select, settled, thumbnail } from './browser.mjs';
import { Daemon } from './daemon.mjs';
import { ROOM, context, edit, numbers, page, roomOps, serve, tab, violations, withScene } from './stage.mjs';

const FOLDER = mkdtempSync(join(tmpdir(), 'lumend-e2e-'));
const daemon = serve(ROOM);

const said = (p) => p.locator('.visually-hidden[role=status][aria-live]').textContent();
const add = async (kind) => {
    await page.getByRole('button', { name: 'Add', exact: true }).click();
    await page.getByRole('menuitem', { name: new RegExp(`^${kind}`) }).click();
};

/** They lie over the picture. */
async function dismissAll() {
    while (await page.locator('.toast').count()) await page.locator('.toast').first().getByLabel('Dismiss').click();
}

test('lamps of every kind are put under the ceiling, light what is seen, and are taken away with a way back', async () => {
    await edit(() => field(page, 'ceiling-panel', 'ceiling-panel on').click());
    await edit(() => field(page, 'accent', 'accent on').click());
    for (const [kind, id] of [['Bulb', 'bulb'], ['Spot', 'spot'], ['Panel', 'panel'], ['Downlight', 'downlight'], ['Globe', 'globe'], ['Sun', 'sun']]) {
        await edit(() => add(kind));
        await row(page, id).locator('.light-details').waitFor();
        if (kind !== 'Sun') {
            const [x, y] = await numbers(id, 'X', 'Y');
            // The ceiling is 4 m high.
            assert.ok(Math.abs(x) < 0.5 && y > 3.7 && y < 4, `${kind} at ${x}, ${y}`);
            await eventually(async () => (await measure(page)).mean > 0.001, () => `${kind} lights nothing`);
        }
        await edit(() => page.locator('.stage').press('Delete'));
        assert.equal(await row(page, id).count(), 0);
    }
    await edit(() => page.locator('.toast', { hasText: 'Removed sun' }).getByRole('button', { name: 'Undo' }).click());
    assert.equal(await row(page, 'sun').count(), 1, 'it is there again');
    // After another step undo would take that one back: then the lamp is made again.
    await select(page, 'sun');
    await edit(() => page.locator('.stage').press('Delete'));
    await edit(() => field(page, 'accent', 'accent on').click());
    await edit(() => page.locator('.toast', { hasText: 'Removed sun' }).getByRole('button', { name: 'Undo' }).click());
    assert.equal(await row(page, 'sun').count(), 1);
    assert.equal(await field(page, 'accent', 'accent on').getAttribute('aria-checked'), 'true', 'and the other step stays');
    await select(page, 'sun');
    await edit(() => page.locator('.stage').press('Delete'));
    await edit(() => field(page, 'ceiling-panel', 'ceiling-panel on').click());
});

test('an arrow key that is held moves a lamp by one step of undo; one that is pressed again, by another', async () => {
    const where = () => numbers('accent', 'X', 'Y', 'Z');
    await select(page, 'accent');
    const mark = page.getByRole('button', { name: /^Lamp accent:/ });
    const before = await where();
    const hold = async (times) => {
        await mark.focus();
        for (let i = 0; i < times; i++) {
            const last = String(await where());
            await page.keyboard.down('ArrowRight');
            await eventually(async () => String(await where()) !== last, where);
        }
        await page.keyboard.up('ArrowRight');
    };
    await edit(() => hold(4));
    const held = await where();
    await edit(() => hold(1));
    await edit(() => page.locator('.stage').press('z'));
    await eventually(async () => String(await where()) === String(held), where);
    await edit(() => page.locator('.stage').press('z'));
    await eventually(async () => String(await where()) === String(before), where);
});

test('a spot is put where the picture was picked, pointed at what is clicked, copied and grouped', async () => {
    const stage = await page.locator('.stage').boundingBox();
    const at = (x, y) => page.mouse.click(stage.x + x * stage.width, stage.y + y * stage.height);
    await dismissAll();
    await page.locator('.stage').press('Escape');
    await at(0.5, 0.97);
    await page.getByRole('complementary', { name: 'Picked point' }).locator('b', { hasText: 'floor' }).waitFor();
    await edit(() => add('Spot'));
    assert.ok(Math.abs((await numbers('spot', 'Y'))[0]) < 0.1, 'on the floor');
    assert.deepEqual(await numbers('spot', 'Tilt'), [180], 'shining up from it');
    await page.locator('.stage').press('Escape');
    await select(page, 'spot');
    await page.getByRole('button', { name: 'Point at…' }).click();
    await page.getByText('points at what you click').waitFor();
    await edit(() => at(0.15, 0.5));
    const [tilt, turn] = await numbers('spot', 'Tilt', 'Turn');
    assert.ok(tilt > 90 && tilt < 175 && turn < -45, `at the left wall: tilt ${tilt}, turn ${turn}`);
    assert.equal(await page.getByText('points at what you click').count(), 0, 'once');
    assert.match(await said(page), /^spot points at/);
    await edit(() => page.locator('.stage').press('Control+d'));
    await row(page, 'spot-2').locator('.light-details').waitFor();
    assert.deepEqual(await numbers('spot-2', 'Tilt', 'Turn'), [tilt, turn]);
    assert.ok((await numbers('spot-2', 'X'))[0] > 0.1, 'beside the first');
    for (const id of ['spot', 'spot-2']) {
        await select(page, id);
        await edit(async () => {
            await page.getByLabel(`${id} group`).fill('my spots');
            await page.getByLabel(`${id} group`).press('Enter');
        });
    }
    await page.locator('.light-group-head .light-name[title="my-spots"]').waitFor();
    await page.getByRole('switch', { name: 'Group my-spots on' }).waitFor();
    for (const id of ['spot', 'spot-2']) {
        await select(page, id);
        await edit(() => page.locator('.stage').press('Delete'));
    }
});

test('the scene is saved as glTF, which lumend opens again', async () => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download as glTF' }).click()]);
    assert.equal(download.suggestedFilename(), 'scene.glb');
    const file = join(FOLDER, 'scene.glb');
    await download.saveAs(file);
    assert.equal(readFileSync(file).toString('latin1', 0, 4), 'glTF');
    const run = spawnSync(process.env.LUMEND, ['render', '--scene', file, '--method', 'whitted', '--size', '60x40', '--out', join(FOLDER, 'scene.png')]);
    assert.equal(run.status, 0, `${run.stderr}`);
});

test('the scene is saved as a file that lumend renders', async () => {
    await page.locator('.stage').press('Escape');
    await edit(() => add('Globe'));
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download the scene' }).click()]);
    assert.equal(download.suggestedFilename(), 'scene.jsonl');
    const file = join(FOLDER, 'scene.jsonl');
    await download.saveAs(file);
    const saved = readFileSync(file, 'utf8').trim().split('\n').map((line) => JSON.parse(line));
    assert.equal(saved.find((op) => op.id === 'globe')?.kind, 'sphere');
    const out = join(FOLDER, 'scene.png');
    const run = spawnSync(process.env.LUMEND, ['render', '--scene', file, '--method', 'whitted', '--size', '60x40', '--out', out]);
    assert.equal(run.status, 0, String(run.stderr));
    await edit(() => page.locator('.stage').press('Delete'));
});

test('a work plane tells mean and uniformity of the floor, follows a lamp that is switched off, and is saved as a table', async () => {
    await page.getByRole('button', { name: 'Add work plane' }).press('Enter');
    const plane = page.locator('.sensor');
    const mean = async () => Number(((await plane.innerText()).match(/Mean\s+([\d\u2009.]+)/) ?? [])[1]?.replace('\u2009', ''));
    await eventually(async () => (await mean()) > 0, async () => plane.innerText());
    await eventually(async () => /Uniformity[^]*(meets|misses) 0\.6/.test(await plane.innerText()), () => plane.innerText());
    const before = await mean();
    await field(page, 'ceiling-panel', 'ceiling-panel on').click();
    await eventually(async () => (await mean()) < before / 2, async () => `${before} lx, then ${await plane.innerText()}`);
    await field(page, 'ceiling-panel', 'ceiling-panel on').click();
    await eventually(async () => (await mean()) > before / 2, async () => `${before} lx, then ${await plane.innerText()}`);
    const [file] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'CSV' }).click()]);
    const lines = readFileSync(await file.path(), 'utf8').trim().split('\n');
    assert.equal(lines[0], 'sensor,quantity,x_m,y_m,z_m,value,stderr');
    assert.match(lines[1], /^work-plane,plane,(-?[\d.e-]+,){4}[\d.e-]+$/);
    const [pageFile] = await Promise.all([page.waitForEvent('download', { timeout: 600000 }), page.getByRole('button', { name: 'Report' }).press('Enter')]);
    const html = readFileSync(await pageFile.path(), 'utf8');
    assert.match(html, /<td>work-plane<td>horizontal<td class="n">\d/);
    assert.equal(html.match(/data:image\/png/g).length, 2);
    await page.getByRole('button', { name: 'Remove work-plane' }).click();
    await plane.waitFor({ state: 'detached' });
    await settled(tab);
});

test('sun and sky are let in, stand by the hour that a key sets, and are as bright as the day until they are told otherwise', async () => {
    await edit(() => page.getByRole('button', { name: 'Add sun and sky' }).press('Enter'));
    const panel = page.getByRole('region', { name: 'Daylight' });
    const elevation = async () => Number(((await panel.innerText()).match(/elevation\s+(-?[\d.]+)°/) ?? [])[1]);
    await eventually(async () => Number.isFinite(await elevation()), () => panel.innerText());
    assert.match(await panel.innerText(), /sun\s+[\d.]+ k?lx/);
    const before = await elevation();
    await edit(() => panel.getByRole('slider', { name: 'Time of day' }).press('ArrowLeft'));
    await eventually(async () => (await elevation()) !== before, async () => `${before} degrees, then ${await panel.innerText()}`);
    assert.match(await row(page, 'sky').innerText(), /automatic/);
    await edit(() => row(page, 'sky').getByRole('slider').press('End'));
    assert.match(await row(page, 'sky').innerText(), /lx/);
    await edit(() => row(page, 'sky').getByRole('button', { name: /as bright as place/ }).click());
    assert.match(await row(page, 'sky').innerText(), /automatic/);
    for (let n = 0; n < 4; n++) await edit(() => page.keyboard.press('z'));
    await eventually(async () => (await panel.innerText()).includes('Add sun and sky'), () => panel.innerText());
});

test('a sun that was there before is named beside the new one, and switched off with a key', async () => {
    await edit(() => add('Sun'));
    await edit(() => page.getByRole('button', { name: 'Add sun and sky' }).press('Enter'));
    const panel = page.getByRole('region', { name: 'Daylight' });
    await eventually(async () => /Beside the sun “sun” shines/.test(await panel.innerText()), () => panel.innerText());
    await edit(() => panel.getByRole('button', { name: 'Switch it off' }).press('Enter'));
    await eventually(async () => !/Beside the sun/.test(await panel.innerText()), () => panel.innerText());
    for (let n = 0; n < 3; n++) await edit(() => page.locator('.stage').press('z'));
    await eventually(async () => (await row(page, 'sun').count()) === 0, () => panel.innerText());
});

test('a hidden tab goes on asking and acknowledging, and sends what was changed last', async () => {
    const hide = (hidden) =>
        page.evaluate((h) => {
            Object.defineProperty(document, 'hidden', { value: h, configurable: true });
            document.dispatchEvent(new Event('visibilitychange'));
        }, hidden);
    await hide(true);
    const from = tab.watch.sent.length;
    const acks = () => tab.watch.sent.slice(from).filter((m) => m.method === 'frame.ack');
    await field(page, 'accent', 'accent on').click();
    await eventually(() => tab.watch.sent.slice(from).some((m) => m.method === 'scene.apply'), () => 'the edit was not sent');
    await eventually(() => acks().length >= 3, () => 'no pings');
    assert.ok(acks().every((m) => m.id !== undefined), 'a frame that nobody looks at is acknowledged by the ping alone');
    assert.ok(acks().every((m) => m.params.held_ms > 0), 'and the time until the ping is not the line\'s');
    await eventually(() => acks().at(-1).params.frame_seq > acks()[0].params.frame_seq, () => 'the picture stands still');
    await hide(false);
    await settled(tab);
    await edit(() => page.locator('.stage').press('z'));
});

test('a tile that cannot be decoded is asked for again, and the frame not said to be shown', async () => {
    await settled(tab);
    const before = await thumbnail(page);
    await page.evaluate(() => {
        const real = window.createImageBitmap;
        let bad = 2;
        window.createImageBitmap = (...args) => (bad-- > 0 ? Promise.reject(new Error('bad tile')) : real(...args));
    });
    const from = tab.watch.sent.length;
    await page.locator('.stage').press('ArrowRight');
    await eventually(() => tab.watch.sent.slice(from).some((m) => m.params?.resend), () => 'nothing was asked for again');
    await settled(tab);
    await page.locator('.stage').press('h');
    await settled(tab);
    const off = difference(before, await thumbnail(page));
    assert.ok(off < 6, `the picture is whole again: rms difference ${off}`);
    assert.equal(await page.locator('.toast-error').count(), 0);
});

test('what is typed in a number stays while others change it, and a slider keeps its scale under the hand', async () => {
    const other = await open(context, daemon.url);
    await settled(other);
    await select(page, 'ceiling-panel');
    const intensity = field(page, 'ceiling-panel', 'Intensity');
    await intensity.fill('12');
    await select(other.page, 'ceiling-panel');
    await field(other.page, 'ceiling-panel', 'Intensity').fill('7000');
    await other.page.keyboard.press('Enter');
    await row(page, 'ceiling-panel').locator('.light-value', { hasText: '7' }).waitFor();
    assert.equal(await intensity.inputValue(), '12');
    await page.keyboard.press('Escape');
    assert.equal(await intensity.inputValue(), '7000', 'Escape takes the draft back');
    // Brighter than the slider reaches: its end is at the value, and must stay there while it is dragged.
    await intensity.fill('10000000');
    await page.keyboard.press('Enter');
    const slider = page.getByLabel('ceiling-panel intensity');
    await row(page, 'ceiling-panel').locator('.light-value', { hasText: '10' }).waitFor();
    const box = await slider.boundingBox();
    const y = box.y + box.height / 2;
    const right = box.x + box.width - 7;
    await page.mouse.move(right, y);
    await page.mouse.down();
    for (const x of [right - 20, right - 40, right - 20, right]) await page.mouse.move(x, y, { steps: 4 });
    assert.equal(await slider.getAttribute('aria-valuetext'), '10\u2009000\u2009000 lumens', 'back where it was taken');
    await page.mouse.up();
    await intensity.fill('9000');
    await page.keyboard.press('Enter');
    await other.page.close();
    await settled(tab);
});

test('everything goes by keyboard: measuring, looking around, selecting a mark; letters in a list stay there', async () => {
    const stage = page.locator('.stage');
    await page.keyboard.press('Escape');
    await stage.focus();
    await page.keyboard.press('Enter');
    const card = page.getByRole('complementary', { name: 'Picked point' });
    await card.locator('b', { hasText: 'back-wall' }).waitFor();
    await eventually(async () => /lux/.test(await card.locator('[role=status]').textContent()), () => 'the reading is not said');
    const seq = tab.watch.sentSeq;
    await stage.press('Control+ArrowLeft');
    await settled(tab);
    assert.ok(tab.watch.sentSeq > seq, 'the camera turned');
    await stage.press('h');
    await stage.press('Escape');
    await select(page, 'accent');
    const mark = page.getByRole('button', { name: 'Lamp accent' });
    await edit(() => mark.press('ArrowRight'));
    assert.match(await said(page), /^accent moved to /);
    await edit(() => page.locator('.stage').press('z'));
    assert.equal(await said(page), 'Undone');
    await mark.press('Enter');
    await row(page, 'accent').locator('.light-details').waitFor({ state: 'detached' });
    await mark.press('Space');
    await row(page, 'accent').locator('.light-details').waitFor();
    const on = () => field(page, 'accent', 'accent on').getAttribute('aria-checked');
    await page.getByLabel('Tone map').press('o');
    await page.getByLabel('Tone map').press('s');
    assert.equal(await on(), 'true');
    assert.equal(await page.locator('.mode').count(), 0, 'nothing was soloed');
    await page.getByLabel('Tone map').selectOption('agx');
    // Letters can be kept to the picture.
    await page.locator('.stage').press('?');
    await page.getByLabel(/Keys of one character/).uncheck();
    await page.getByRole('button', { name: 'Close' }).click();
    await page.getByRole('button', { name: 'Lamp markers' }).press('o');
    assert.equal(await on(), 'true');
    await edit(() => page.locator('.stage').press('o'));
    assert.equal(await on(), 'false');
    await edit(() => page.locator('.stage').press('o'));
    await page.locator('.stage').press('?');
    await page.getByLabel(/Keys of one character/).check();
    await page.keyboard.press('Escape');
});

test('axe finds nothing: plain, with a lamp and a reading, in menus and help, in high contrast, on a phone', async () => {
    await settled(tab);
    const check = async (what) => assert.deepEqual(await violations(page), [], what);
    await page.locator('.stage').press('Escape');
    // From the first section on, whatever the tests before have looked at.
    await page.locator('.sections').evaluate((panel) => panel.scrollTo(0, 0));
    await check('plain');
    await select(page, 'accent');
    await page.locator('.stage').press('Enter');
    await page.getByRole('complementary', { name: 'Picked point' }).waitFor();
    await page.getByLabel('Solo accent').click();
    await check('a lamp, a reading, solo');
    await page.getByLabel('Solo accent').click();
    await page.getByRole('button', { name: 'Add', exact: true }).click();
    await check('menu');
    await page.keyboard.press('Escape');
    await page.locator('.stage').press('?');
    await check('help');
    await page.keyboard.press('Escape');
    await page.getByRole('button', { name: 'High contrast' }).click();
    await check('high contrast');
    await page.getByRole('button', { name: 'High contrast' }).click();
    await page.setViewportSize({ width: 390, height: 800 });
    await check('phone');
    await page.setViewportSize({ width: 1000, height: 640 });
    await settled(tab);
});

test('at 200 and 400 percent, and on a phone, nothing is cut off and all can be reached', async () => {
    for (const [width, height] of [[720, 450], [360, 225], [320, 640], [420, 860]]) {
        await page.setViewportSize({ width, height });
        const found = await page.evaluate(() => {
            const box = (s) => document.querySelector(s).getBoundingClientRect();
            const cut = [...document.querySelectorAll('.topbar button, .status > *, .link')]
                .map((e) => [e.className + (e.getAttribute('aria-label') ?? ''), e.getBoundingClientRect()])
                .filter(([, b]) => b.width > 0 && (b.right > innerWidth + 0.5 || b.left < -0.5 || b.bottom > innerHeight + 0.5))
                .map(([name]) => name);
            return { cut, sideways: document.documentElement.scrollWidth > innerWidth, view: box('.viewport').height, panel: box('.panel').height };
        });
        assert.deepEqual(found.cut, [], `${width}x${height}`);
        assert.ok(!found.sideways && found.view >= 90 && found.panel >= 90, `${width}x${height}: ${JSON.stringify(found)}`);
    }
    await page.setViewportSize({ width: 1000, height: 640 });
    await settled(tab);
});

test('300 lamps: all are in the list, few are drawn, one is a stop of the Tab key, the nearest are marked', async () => {
    const lamps = [...Array(300).keys()].map((i) => ({
        ...{ op: 'add', type: 'light', id: `track/lamp-${String(i).padStart(3, '0')}`, kind: i % 10 === 0 ? 'spot' : 'point', flux_lm: 20 },
        position: [-1.8 + 0.12 * (i % 30), 3.5, -1.8 + 0.12 * Math.floor(i / 30)],
    }));
    await withScene([...roomOps(), '{"op":"set","id":"render","path":"/spp","value":1}', ...lamps.map((op) => JSON.stringify(op))], null, async (own) => {
        const p = own.page;
        await p.locator('.light-list.is-long').waitFor();
        const drawn = () => p.locator('.light').count();
        const stops = () => p.locator('.light-list :is(button, input)').evaluateAll((all) => all.filter((e) => e.tabIndex >= 0).length);
        assert.ok((await drawn()) < 60, `${await drawn()} rows`);
        assert.ok((await stops()) <= 5, `${await stops()} stops`);
        await p.locator('.light-list .light-name').first().focus();
        const focused = () => p.evaluate(() => document.activeElement.title);
        const first = await focused();
        await p.keyboard.press('ArrowDown');
        await p.keyboard.press('ArrowDown');
        await eventually(async () => (await focused()) !== first, () => 'the focus stays');
        await p.keyboard.press('End');
        await eventually(async () => (await focused()) === 'track/lamp-299', () => 'End does not lead to the last');
        assert.ok(await p.locator('.light-name[title="track/lamp-299"]').isVisible());
        const place = await p.locator('li', { has: p.locator('.light-name[title="track/lamp-299"]') }).first();
        assert.deepEqual([await place.getAttribute('aria-posinset'), await place.getAttribute('aria-setsize')], ['302', '302']);
        assert.ok((await drawn()) < 60);
        await p.keyboard.press('Home');
        await eventually(async () => (await focused()) === first, () => 'Home does not lead back');
        const marks = await p.locator('.overlay .lamp').count();
        assert.ok(marks >= 40 && marks <= 49, `${marks} marks`);
        // One that is far down the list is selected in the picture.
        await p.getByLabel('Filter lights by name').fill('spot track');
        await eventually(async () => (await p.locator('.light').count()) === 30, () => 'kinds are not found');
        await p.locator('.light-name[title="track/lamp-290"]').click();
        await p.getByLabel('Filter lights by name').fill('');
        await p.locator('.light.is-selected .light-name[title="track/lamp-290"]').waitFor();
        await eventually(() => p.locator('.light.is-selected').isVisible(), () => 'the selected lamp is not in sight');
        await p.locator('.light-name[title="track/lamp-290"]').focus();
        await p.keyboard.press('Delete');
        await p.locator('.light-name[title="track/lamp-290"]').waitFor({ state: 'detached' });
        await eventually(async () => (await focused()) === 'track/lamp-291', () => 'the focus goes to the next');
        assert.deepEqual(await violations(p), []);
        assert.deepEqual(own.watch.errors, []);
    });
});

test('a server that does not answer is told in seconds; edits that vanish with it are counted and sent again, once', async () => {
    await withScene(roomOps(), null, async (own, server) => {
        const p = own.page;
        await settled(own);
        await p.locator('.stage').press('Enter');
        await p.getByRole('complementary', { name: 'Picked point' }).locator('.reading-lux:not(.is-old)', { hasText: /\d/ }).waitFor();
        process.kill(server.child.pid, 'SIGSTOP');
        await p.getByText('no answer', { exact: true }).waitFor();
        await p.locator('.reading-lux.is-old').waitFor();
        process.kill(server.child.pid, 'SIGCONT');
        await p.getByText('connected', { exact: true }).waitFor();
        process.kill(server.child.pid, 'SIGSTOP');
        await field(p, 'accent', 'accent on').click();
        await eventually(() => own.watch.sent.some((m) => m.method === 'scene.apply'), () => 'nothing was sent');
        server.child.kill('SIGKILL');
        await server.exited;
        await p.locator('.banner').waitFor();
        assert.equal(await p.locator('.link-text').textContent(), 'offline');
        await server.start();
        await p.locator('.banner').waitFor({ state: 'detached' });
        const notice = p.locator('.toast', { hasText: 'One change was lost' });
        await notice.waitFor();
        assert.equal(await field(p, 'accent', 'accent on').getAttribute('aria-checked'), 'true');
        await notice.getByRole('button', { name: 'Send again' }).click();
        await eventually(async () => (await field(p, 'accent', 'accent on').getAttribute('aria-checked')) === 'false', () => 'it was not sent');
        const ids = own.watch.sent.filter((m) => m.method === 'scene.apply').map((m) => m.params.op_id);
        assert.equal(ids.length, 2);
        assert.equal(ids[0], ids[1], 'the same edit');
        assert.equal(await notice.count(), 0);
    });
});

/** A line of `delayMs` each way to a port that is given once it is known. */
async function slowLine(delayMs) {
    const line = { to: 0 };
    const server = createServer((client) => {
        const upstream = connect(line.to, '127.0.0.1');
        const carry = (from, to) => {
            from.on('data', (chunk) => setTimeout(() => to.writable && to.write(chunk), delayMs));
            from.on('close', () => setTimeout(() => to.destroy(), delayMs));
            from.on('error', () => undefined);
        };
        carry(client, upstream);
        carry(upstream, client);
    });
    await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
    line.port = server.address().port;
    line.close = () => new Promise((closed) => (server.close(closed), server.closeAllConnections?.()));
    return line;
}

test('on a line of half a second each way a drag sends no more than two questions ahead, and ends where the hand did', async () => {
    const line = await slowLine(500);
    const own = new Daemon(ROOM, null, ['--allow-origin', `http://127.0.0.1:${line.port}`]);
    line.to = Number(new URL(await own.start()).port);
    const answered = [];
    const { page: p, watch } = await open(context, own.url.replace(`:${line.to}`, `:${line.port}`), (text) => {
        const { id } = JSON.parse(text);
        if (id !== undefined) answered.push(id);
    });
    try {
        await p.getByLabel('Resolution').selectOption('fast');
        await settled({ page: p, watch });
        const waiting = (method) => watch.sent.filter((m) => m.method === method && !answered.includes(m.id)).length;
        const most = { 'view.update': 0, 'scene.apply': 0 };
        const note = () => Object.keys(most).forEach((method) => (most[method] = Math.max(most[method], waiting(method))));
        const box = await p.getByLabel('ceiling-panel intensity').boundingBox();
        const y = box.y + box.height / 2;
        await p.mouse.move(box.x + 0.8 * box.width, y);
        await p.mouse.down();
        for (let i = 0; i < 40; i++) {
            await p.mouse.move(box.x + (0.8 - 0.01 * i) * box.width, y);
            note();
        }
        await p.mouse.up();
        const value = await p.getByLabel('ceiling-panel intensity').getAttribute('aria-valuetext');
        for (let i = 0; i < 40; i++) {
            await p.locator('.stage').press('ArrowRight');
            note();
        }
        await eventually(() => waiting('view.update') + waiting('scene.apply') === 0, () => 'not all is answered');
        assert.ok(Object.values(most).every((n) => n >= 1 && n <= 2), JSON.stringify(most));
        const { value: sent } = watch.sent.filter((m) => m.method === 'scene.apply').at(-1).params.ops[0];
        assert.equal(value, `${String(sent).replace(/\B(?=(\d{3})+$)/, '\u2009')} lumens`);
        assert.equal(await p.locator('.link-online').count(), 1, 'slow is not silent');
        assert.deepEqual(watch.errors, []);
    } finally {
        await p.close();
        assert.equal(await own.stop(), 0, own.log);
        await line.close();
    }
});

test('2,000 objects: any is picked, and dragged by its mark', async () => {
    const at = (i) => [-1.8 + 0.085 * (i % 43), 0.04 + 0.08 * (Math.floor(i / 43) % 12), -1.8 + 0.6 * Math.floor(i / 516)];
    const crates = [...Array(2000).keys()].map((i) => ({
        ...{ op: 'add', type: 'object', id: `crate-${i}`, mesh: 'unit-box', material: 'white' },
        transform: { translate: at(i), scale: [0.06, 0.06, 0.06] },
    }));
    await withScene([...roomOps(), ...crates.map((op) => JSON.stringify(op))], null, async (own) => {
        const p = own.page;
        await settled(own, { spp: 1 });
        const stage = await p.locator('.stage').boundingBox();
        await p.mouse.click(stage.x + 0.5 * stage.width, stage.y + 0.85 * stage.height);
        const mark = p.getByRole('button', { name: /^crate-\d+: drag/ });
        await mark.waitFor();
        await mark.press('ArrowUp');
        await eventually(() => own.watch.sent.some((m) => m.method === 'scene.apply'), () => 'it was not moved');
        await settled(own, { rev: 2, spp: 1 });
        assert.deepEqual(own.watch.errors, []);
    });
});

test('where the scene is kept, what was changed is there after a crash, and can be taken back', async () => {
    const own = new Daemon(ROOM, undefined, ['--state', join(FOLDER, 'state')]);
    const { page: p } = await open(context, await own.start());
    const accent = () => field(p, 'accent', 'accent on');
    const is = (on) => eventually(async () => (await accent().getAttribute('aria-checked')) === String(on), () => `accent is not ${on}`);
    try {
        await p.getByText('saved', { exact: true }).waitFor();
        assert.equal(await page.getByText('not saved', { exact: true }).count(), 1, 'the other daemon keeps nothing');
        await is(true);
        await accent().click();
        await is(false);
        await p.getByText('saved', { exact: true }).waitFor();
        own.child.kill('SIGKILL');
        await own.exited;
        await p.locator('.banner').waitFor();
        await own.start();
        await p.locator('.banner').waitFor({ state: 'detached' });
        await is(false);
        await p.keyboard.press('z');
        await is(true);
    } finally {
        await p.close();
        assert.equal(await own.stop(), 0, own.log);
    }
});

test('nothing was written to the console as an error', () => assert.deepEqual(tab.watch.errors, []));
