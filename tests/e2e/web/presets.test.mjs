// Looks of the room's light in the panel: stored, recalled with a crossfade, renamed, sorted, removed. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, settled, shownRev } from './browser.mjs';
import { ROOM, edit, page, serve, tab, violations } from './stage.mjs';

serve(ROOM);

test('presets are stored, faded to, changed and removed by keyboard', async () => {
    const panel = page.getByRole('region', { name: 'Presets' });
    const names = () => panel.locator('.look').allTextContents();
    const store = async (name) => {
        await panel.getByLabel('Name of a new preset').fill(name);
        await page.keyboard.press('Enter');
        await panel.getByRole('button', { name, exact: true }).waitFor();
    };
    await store('Day');
    const before = await page.getByLabel('accent intensity', { exact: true }).inputValue();
    await edit(() => page.getByLabel('accent on', { exact: true }).click());
    await store('Evening');
    assert.deepEqual(await names(), ['Day', 'Evening']);

    const fade = panel.getByLabel('Crossfade');
    await fade.fill('3');
    await fade.press('Enter');
    await panel.getByRole('button', { name: 'Day', exact: true }).focus();
    await page.keyboard.press('Enter');
    await panel.locator('.look-progress').waitFor();
    assert.equal(await panel.locator('.look[aria-pressed="true"]').textContent(), 'Day');
    await page.setViewportSize({ width: 1440, height: 900 });
    if (process.env.LUMEND_SHOT) {
        await panel.scrollIntoViewIfNeeded();
        await page.screenshot({ path: process.env.LUMEND_SHOT });
    }
    await panel.getByRole('button', { name: 'Stop the fade' }).waitFor();
    await eventually(async () => (await panel.locator('.look-progress').count()) === 0, () => panel.textContent());
    assert.equal(await page.getByLabel('accent on', { exact: true }).isChecked(), true);
    assert.equal(await page.getByLabel('accent intensity', { exact: true }).inputValue(), before);
    await settled(tab, { rev: await shownRev(page) });

    await panel.getByRole('button', { name: 'Change Evening' }).click();
    await panel.getByRole('button', { name: 'Up', exact: true }).click();
    await eventually(async () => (await names())[0] === 'Evening', names);
    const name = panel.getByLabel('Name of Evening');
    await name.fill('Presentation');
    await name.press('Enter');
    await eventually(async () => (await names())[0] === 'Presentation', names);
    assert.deepEqual(await violations(page), []);
    await panel.getByRole('button', { name: 'Delete' }).click();
    await eventually(async () => (await names()).length === 1, names);
    assert.deepEqual(tab.watch.errors, []);
});
