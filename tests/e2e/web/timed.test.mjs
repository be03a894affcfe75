// From an empty room to twelve luminaires of a library, a work plane that passes 500 lx and Uo 0.60, and a report, by what is to be seen on the
// page and nothing else. It prints how long that took and in how many actions; LUMEND_SHOTS=FOLDER saves a picture of each step.
// Files: ../shared/scenes/ies.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch, eventually, open } from './browser.mjs';
import { sceneFile } from './stage.mjs';
import { Daemon } from './daemon.mjs';

const IES = fileURLToPath(new URL('../../../../shared/scenes/ies', import.meta.url));
const SHOTS = process.env.LUMEND_SHOTS;
/** As people have it. */
const WINDOW = { width: 1440, height: 900 };
/** EN 12464-1, 34.2: writing, typing, reading, data processing. */
const WANTED = { lx: 500, uniformity: 0.6 };

/** What a person does, one by one: a click, a word typed, a key. */
class Hand {
    actions = 0;
    steps = [];

    constructor(page) {
        this.page = page;
        this.began = this.stepBegan = performance.now();
    }

    async press(locator) {
        this.actions++;
        await locator.click();
    }

    async type(locator, text) {
        this.actions++;
        await locator.fill(text);
        await locator.press('Enter');
    }

    /** A step is done: what it took, and how it looks. */
    async done(name) {
        const now = performance.now();
        this.steps.push({ name, seconds: (now - this.stepBegan) / 1000, actions: this.actions });
        if (SHOTS) {
            mkdirSync(SHOTS, { recursive: true });
            await this.page.screenshot({ path: join(SHOTS, `${this.steps.length}-${name.replace(/\W+/g, '-')}.png`) });
        }
        this.stepBegan = performance.now();
    }

    tell() {
        const seconds = this.steps.reduce((sum, s) => sum + s.seconds, 0);
        for (const s of this.steps) console.log(`  ${s.name}: ${s.seconds.toFixed(1)} s, ${s.actions} actions by then`);
        console.log(`from nothing to a report: ${seconds.toFixed(1)} s, ${this.actions} actions`);
    }
}

test('from an empty room to twelve luminaires, a grid that passes, and a report', { skip: !existsSync(IES) && `no ${IES}` }, async () => {
    const daemon = new Daemon(sceneFile([]), IES);
    await daemon.start();
    const context = await launch();
    try {
        const tab = await open(context, daemon.url);
        await tab.page.setViewportSize(WINDOW);
        await tab.page.getByText('connected', { exact: true }).waitFor();
        await work(tab.page);
        assert.deepEqual(tab.watch.errors, []);
    } finally {
        await context.close();
        assert.equal(await daemon.stop(), 0, daemon.log);
    }
});

async function work(page) {
    const hand = new Hand(page);
    const button = (name) => page.getByRole('button', { name, exact: true });
    const field = (name) => page.getByRole('spinbutton', { name, exact: true });

    await hand.press(button('An empty room'));
    await hand.done('a room is offered');
    await hand.type(field('Length'), '7.2 m');
    await hand.type(field('Width'), '5.4 m');
    await hand.press(button('Build it'));
    await page.getByText('The scene has no light').waitFor();
    await hand.done('the room is there');

    await hand.type(page.getByLabel('Search luminaires by name or file'), 'indoor');
    await hand.press(page.getByRole('listbox', { name: /^Luminaires/ }).getByRole('option').first());
    await page.getByRole('img', { name: /^Polar diagram/ }).first().waitFor();
    await hand.done('a luminaire is found');
    await hand.press(button('Hang under the ceiling'));
    await button('Rows…').waitFor();
    await hand.done('one hangs under the ceiling');
    await hand.press(button('Rows…'));
    const form = page.getByRole('group', { name: /^Rows of/ });
    await form.getByText(/^12 lamps/).waitFor();
    await hand.press(form.getByRole('button', { name: 'Spread over the floor' }));
    await page.getByRole('switch', { name: /^Group .* on/ }).waitFor();
    await hand.done('twelve are spread over the floor');

    await hand.press(button('Add work plane'));
    const plane = page.getByRole('region', { name: 'Measure' }).getByRole('listitem').first();
    const value = async (what) => Number(new RegExp(`${what}\\s+([\\d.,\\u2009]+)`).exec(await plane.innerText())?.[1]?.replace(/[,\u2009]/g, '') ?? NaN);
    await eventually(async () => (await value('Mean')) > 0 && (await value('Uniformity')) >= 0, () => plane.innerText());
    await hand.done('a work plane measures');

    // As bright as is asked for, and not much more: all twelve are dimmed as one.
    for (let tries = 0; tries < 4; tries++) {
        const mean = await value('Mean');
        if (mean >= WANTED.lx && mean < 1.3 * WANTED.lx) break;
        await hand.press(page.getByRole('button', { name: /^Select the \d+ lamps of/ }));
        const dim = page.getByRole('region', { name: '12 lamps selected' }).getByRole('spinbutton', { name: 'Dim' });
        const percent = (Number(await dim.inputValue()) * 1.1 * WANTED.lx) / mean;
        await hand.type(dim, `${percent.toFixed(0)} %`);
        const wanted = 1.1 * WANTED.lx;
        await eventually(async () => Math.abs((await value('Mean')) / wanted - 1) < 0.05, () => plane.innerText());
        await hand.done('all twelve are dimmed as one');
    }
    await eventually(async () => /meets 500[^]*meets 0\.6/.test(await plane.innerText()), () => plane.innerText());
    await hand.done('the grid passes');

    const [file] = await Promise.all([page.waitForEvent('download', { timeout: 600000 }), hand.press(button('Report'))]);
    const path = await file.path();
    await hand.done('the report is saved');
    hand.tell();

    const mean = await value('Mean');
    const uniformity = await value('Uniformity');
    assert.ok(mean >= WANTED.lx && uniformity >= WANTED.uniformity, `Mean ${mean} lx, Uo ${uniformity}`);
    console.log(`Em ${mean} lx, Uo ${uniformity}`);
    const html = readFileSync(path, 'utf8');
    assert.match(html, /<td class="n">12/, 'twelve of them are in its list');
    assert.equal(html.match(/data:image\/png/g).length, 2);
    assert.ok(statSync(path).size > 1e4);
    if (SHOTS) {
        await page.goto(`file://${path}`);
        await page.screenshot({ path: join(SHOTS, 'report.png') });
    }
}
