// A lighting desk in the panel: a patch is made there, and what an independent sender sends is told. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { eventually, launch, open } from './browser.mjs';
import { Daemon } from './daemon.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
const SENDER = fileURLToPath(new URL('desk_sender.mjs', import.meta.url));
const AXE = readFileSync(createRequire(new URL('../../../clients/web/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');
const daemon = new Daemon(ROOM, null, ['--sacn', '127.0.0.1:0']);
let context;
let page;

before(async () => {
    await daemon.start();
    context = await launch();
    ({ page } = await open(context, daemon.url));
});

after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

test('a patch is made, changed, driven and removed', async () => {
    const desk = page.getByRole('region', { name: 'Desk' });
    await desk.getByRole('button', { name: 'Add patch' }).click();
    const patch = desk.getByRole('listitem');
    await patch.getByLabel('Channels').selectOption('rgb');
    const universe = patch.getByLabel('Universe');
    await universe.fill('3');
    await universe.press('Enter');
    await eventually(async () => /universe 3: silent/.test(await desk.textContent()), () => desk.textContent());
    const port = /sacn on 127.0.0.1 port (\d+)/.exec(daemon.log)[1];
    const sender = spawn(process.execPath, [SENDER, port, '3', '1', '26400'], { stdio: 'ignore' });
    after(() => sender.kill());
    await eventually(async () => /npm at \d\d Hz, priority 120/.test(await desk.textContent()), () => desk.textContent());
    await page.evaluate(AXE);
    const { violations } = await page.evaluate(() => window.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'wcag22aa'] }));
    assert.deepEqual(violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.target).join()}`), []);
    if (process.env.LUMEND_SHOT) await desk.screenshot({ path: process.env.LUMEND_SHOT });
    await patch.getByRole('button', { name: /^Remove the patch/ }).click();
    await eventually(async () => (await patch.count()) === 0, () => desk.textContent());
});
