// People whose token is to look, to measure, or to edit: what they find, and what they are told. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch, open, select, settled, shownRev } from './browser.mjs';
import { Daemon } from './daemon.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
const AXE = readFileSync(createRequire(new URL('../../../clients/web/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');
const daemon = new Daemon(ROOM);
const people = join(daemon.folder, 'people');
const tokenOf = (name) => `token-of-${name}-0123456789`;
let context;

function write(roles) {
    const lines = Object.entries(roles).map(([name, role]) => `${name} ${role} sha256:${createHash('sha256').update(tokenOf(name)).digest('hex')}\n`);
    writeFileSync(people, lines.join(''), { mode: 0o600 });
}

before(async () => {
    write({ vera: 'view', mia: 'measure', ed: 'edit' });
    daemon.options.push('--tokens', people);
    await daemon.start();
    context = await launch();
});

after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

async function come(name) {
    const tab = await open(context, `http://127.0.0.1:${daemon.port}/#t=${tokenOf(name)}`);
    await tab.page.getByLabel('Resolution').selectOption('fast');
    await settled(tab);
    return tab;
}

const edits = (tab) => tab.watch.sent.filter((m) => /^scene\.(apply|undo|redo)$|^asset\./.test(m.method));
const probes = (tab) => tab.watch.sent.filter((m) => /^probe$|^sensor\./.test(m.method));

test('who may look sees the scene and all values, turns the camera, and is told why the rest is not for her', async () => {
    const tab = await come('vera');
    const { page } = tab;
    assert.equal(await page.locator('.kept', { hasText: 'to look' }).count(), 1);
    for (const name of ['Undo (Z)', 'Redo (Shift+Z)']) assert.ok(await page.getByLabel(name).isDisabled());
    assert.match(await page.getByLabel('Undo (Z)').getAttribute('title'), /you may look, not change/);
    await select(page, 'accent');
    for (const label of ['accent intensity', 'accent on', 'Intensity']) assert.ok(await page.getByLabel(label, { exact: true }).first().isDisabled(), label);
    assert.equal(await page.locator('#library-title').count(), 0);
    // By key, and by hand in the picture, everything can be tried: nothing is sent, and it is said.
    await page.locator('.stage').focus();
    for (const key of ['o', 'Delete', 'z']) await page.keyboard.press(key);
    await page.locator('.toast', { hasText: 'you may look, not change' }).waitFor();
    assert.equal(await page.locator('.toast').count(), 1, 'it is said once');
    await page.locator('.stage').click({ position: { x: 200, y: 250 } });
    await page.locator('.reading', { hasText: 'not measure' }).waitFor();
    const material = page.getByRole('region', { name: 'Material' });
    await material.getByRole('button', { name: /^More/ }).click();
    for (const name of ['Reflectance ρ', 'Transmittance τ']) {
        const field = material.getByRole('spinbutton', { name });
        assert.match(await field.inputValue(), /^\d/, name);
        assert.ok(await field.isDisabled(), name);
        assert.ok(await material.getByRole('slider', { name }).isDisabled(), name);
    }
    await page.getByLabel('Solo accent').click();
    await settled(tab);
    assert.deepEqual([...edits(tab), ...probes(tab)], []);
    await page.evaluate(AXE);
    assert.deepEqual(await page.evaluate(async () => (await globalThis.axe.run()).violations.map((v) => `${v.id}: ${v.nodes[0].html}`)), []);
    assert.deepEqual(tab.watch.errors, []);
    await page.close();
});

test('who may measure clicks, and reads lux', async () => {
    const tab = await come('mia');
    await tab.page.locator('.stage').click({ position: { x: 200, y: 250 } });
    await tab.page.locator('.reading-lux', { hasText: /[0-9] lx/ }).waitFor();
    assert.equal(await tab.page.locator('.kept', { hasText: 'to measure' }).count(), 1);
    assert.deepEqual(edits(tab), []);
    await tab.page.close();
});

test('who is given another role has it as soon as the server reads the file again', async () => {
    const tab = await come('vera');
    const { page } = tab;
    write({ vera: 'edit', mia: 'measure', ed: 'edit' });
    daemon.child.kill('SIGHUP');
    await page.waitForFunction(() => document.querySelector('[aria-label="Undo (Z)"]')?.disabled === false);
    const rev = await shownRev(page);
    await page.getByLabel('accent on', { exact: true }).click();
    await settled(tab, { rev: rev + 1 });
    assert.equal(edits(tab).filter((m) => m.method === 'scene.apply').length, 1);
    write({ ed: 'edit' });
    daemon.child.kill('SIGHUP');
    await page.getByLabel('Access token', { exact: true }).waitFor();
    await page.close();
});
