// A lighting desk in the panel: a patch is made there, and what an independent sender sends is told. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { eventually } from './browser.mjs';
import { ROOM, page, serve, violations } from './stage.mjs';

const SENDER = fileURLToPath(new URL('desk_sender.mjs', import.meta.url));
const daemon = serve(ROOM, null, ['--sacn', '127.0.0.1:0']);

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
    assert.deepEqual(await violations(page), []);
    if (process.env.LUMEND_SHOT) await desk.screenshot({ path: process.env.LUMEND_SHOT });
    await patch.getByRole('button', { name: /^Remove the patch/ }).click();
    await eventually(async () => (await patch.count()) === 0, () => desk.textContent());
});
