// What the scene was, as a track: looked at, named, compared with now, gone back to, played. By keyboard. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventually, open, settled, shownRev } from './browser.mjs';
import { ROOM, context, edit, page, serve, tab, violations } from './stage.mjs';

const daemon = serve(ROOM);
const bar = () => page.getByRole('region', { name: 'Timeline' });
const track = () => page.getByRole('slider', { name: 'Moment that is shown' });
const said = () => track().getAttribute('aria-valuetext');
const spoken = (text) => page.locator('.visually-hidden[role=status]', { hasText: text }).first().waitFor({ state: 'attached' });
const accent = () => page.getByLabel('accent on', { exact: true });
const hasFocus = async (what) => assert.equal(await what.evaluate((e) => e === document.activeElement), true, `the focus is at ${await page.evaluate(() => document.activeElement.outerHTML.slice(0, 80))}`);
const shot = async (name) => {
    if (process.env.LUMEND_SHOTS) await page.screenshot({ path: `${process.env.LUMEND_SHOTS}/${name}.png` });
};

test('moments are looked at by arrow keys, in this view alone', async () => {
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.locator('.stage').focus();
    await page.keyboard.press('t');
    await track().waitFor();
    await eventually(async () => (await said()).startsWith('Now'), said);
    for (let i = 0; i < 3; i++) await edit(() => accent().click()); // off, on, off
    await eventually(async () => (await track().getAttribute('aria-valuemax')) === '4', async () => `${await track().getAttribute('aria-valuemax')} ${await said()}`);
    const now = await shownRev(page);
    const others = await open(context, daemon.url);
    await settled(others);

    await track().focus();
    await page.keyboard.press('ArrowLeft');
    await eventually(async () => /switch of accent/.test(await said()) && !(await said()).startsWith('Now'), said);
    await eventually(async () => (await shownRev(page)) === now - 1, () => shownRev(page));
    assert.equal(await page.getByRole('status').filter({ hasText: 'As it was' }).count(), 1);
    assert.equal(await accent().isDisabled(), true, 'what would not be seen is not changed');
    await page.keyboard.press('Home');
    await eventually(async () => (await said()).includes('as it began'), said);
    await shot('past');
    assert.deepEqual(await violations(page), []);
    assert.equal(await shownRev(others.page), now, 'others see the scene as it is');
    await page.keyboard.press('End');
    await eventually(async () => (await shownRev(page)) === now, () => shownRev(page));
    await others.page.close();
});

test('a moment is named, compared with now by the line, and gone back to; undo takes that back', async () => {
    const now = await shownRev(page);
    await track().focus();
    await page.keyboard.press('ArrowLeft');
    await eventually(async () => (await shownRev(page)) === now - 1, () => shownRev(page));
    const name = bar().getByLabel('Name of this moment');
    await name.fill('bright');
    await name.press('Enter');
    await bar().getByRole('button', { name: 'bright', exact: true }).waitFor();
    await spoken('This moment is bright');
    await hasFocus(name);
    const then = await shownRev(page);

    await bar().getByRole('button', { name: 'Compare with now' }).focus();
    await page.keyboard.press('Enter');
    await page.locator('.wipe-tag.is-left', { hasText: 'bright' }).waitFor();
    await eventually(async () => (await page.locator('.wipe-tag.is-left').textContent()).includes(`revision ${then}`), () => page.locator('.wipe-tag.is-left').textContent());
    await page.locator('.wipe-picture canvas').waitFor();
    await eventually(async () => (await page.locator('.wipe-tag.is-right').textContent()).includes(`revision ${now}`), () => page.locator('.wipe-tag.is-right').textContent());
    // The other view is made anew while this one's exposure settles.
    const means = () =>
        page.evaluate(() =>
            [...document.querySelectorAll('.wipe-picture canvas, .picture')].map((canvas) => {
                const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
                return data.reduce((sum, v, i) => sum + (i % 4 === 3 ? 0 : v), 0) / data.length;
            }),
        );
    await eventually(async () => {
        const [left, right] = await means();
        return Math.abs(left - right) > 1;
    }, means);
    await shot('compare');
    assert.deepEqual(await violations(page), []);
    await bar().getByRole('button', { name: 'Compare with now' }).press('Enter');
    await page.locator('.wipe-picture canvas').waitFor({ state: 'detached' });
    await hasFocus(bar().getByRole('button', { name: 'Compare with now' }));

    await bar().getByRole('button', { name: 'bright', exact: true }).click();
    await eventually(async () => (await shownRev(page)) === then, () => shownRev(page));
    const back = bar().getByRole('button', { name: 'Go back to here' });
    await back.press('Enter');
    await spoken('The scene is as it was: bright');
    await eventually(async () => accent().isChecked(), said);
    await eventually(async () => (await said()).includes('back to bright'), said);
    await hasFocus(back);
    assert.equal(await back.getAttribute('aria-disabled'), 'true');
    const moments = await track().getAttribute('aria-valuemax');
    await back.press('Enter'); // nothing to do: now is no moment to go back to
    await page.locator('.stage').focus();
    await page.keyboard.press('z');
    await eventually(async () => !(await accent().isChecked()), said);
    await eventually(async () => (await said()).includes('undid switch of accent'), said);
    assert.equal(Number(await track().getAttribute('aria-valuemax')), Number(moments) + 1, 'the undo alone came to it');
});

test('"Now" keeps the focus; in the picture, where it goes away, the picture takes it', async () => {
    for (const [place, keeps] of [[bar(), bar().getByRole('button', { name: 'Now', exact: true })], [page.locator('.is-past'), page.locator('.stage')]]) {
        await track().focus();
        await page.keyboard.press('ArrowLeft');
        await eventually(async () => !(await said()).startsWith('Now'), said);
        await place.getByRole('button', { name: 'Now', exact: true }).press('Enter');
        await eventually(async () => (await said()).startsWith('Now'), said);
        await page.locator('.is-past').waitFor({ state: 'detached' });
        await hasFocus(keeps);
    }
});

test('a name that is typed while somebody else edits is of the moment at which it was begun', async () => {
    const others = await open(context, daemon.url);
    await settled(others);
    const then = await shownRev(others.page); // a page that comes now sees now; this one may still be on its way there
    await eventually(async () => (await shownRev(page)) === then, () => shownRev(page));
    const name = bar().getByRole('textbox', { name: /^Name of/ });
    await name.focus();
    await page.keyboard.type('half ');
    const moments = Number(await track().getAttribute('aria-valuemax'));
    await others.page.getByLabel('accent on', { exact: true }).click();
    await eventually(async () => Number(await track().getAttribute('aria-valuemax')) === moments + 1, said);
    await hasFocus(name);
    await page.keyboard.type('way');
    assert.equal(await name.inputValue(), 'half way');
    await page.keyboard.press('Enter');
    await spoken(/^The moment of .* is half way$/);
    await eventually(async () => (await name.inputValue()) === '', () => name.inputValue());
    await hasFocus(name);
    await bar().getByRole('button', { name: 'half way', exact: true }).click();
    await eventually(async () => (await shownRev(page)) === then, () => shownRev(page));
    await bar().getByRole('button', { name: 'Now', exact: true }).click();
    await others.page.getByLabel('accent on', { exact: true }).click();
    await eventually(async () => (await shownRev(page)) === then + 2, () => shownRev(page));
    await others.page.close();

    await name.fill('ü'.repeat(100));
    assert.equal(await name.inputValue(), 'ü'.repeat(60), 'as many as the server takes');
    await name.press('Escape');
    assert.equal(await name.inputValue(), '');
});

test('played it goes from the first moment to now', async () => {
    await bar().getByLabel('Steps a second').selectOption('5');
    await bar().getByRole('button', { name: 'Play' }).click();
    await eventually(async () => (await page.getByRole('status').filter({ hasText: 'As it was' }).count()) === 1, said);
    await spoken('Played to now');
    assert.ok((await said()).startsWith('Now'));
    await bar().getByRole('button', { name: 'Close the timeline' }).click();
    await eventually(async () => (await bar().count()) === 0, () => bar().count());
    assert.deepEqual(tab.watch.errors, []);
});

test('a server that began anew keeps no moment that is looked at: now is shown, and said', async () => {
    await page.locator('.stage').focus();
    await page.keyboard.press('t');
    await track().waitFor();
    await eventually(async () => Number(await track().getAttribute('aria-valuemax')) > 4, said);
    await track().focus();
    await page.keyboard.press('ArrowLeft');
    await eventually(async () => !(await said()).startsWith('Now'), said);
    assert.equal(await daemon.stop(), 0, daemon.log);
    await page.locator('.banner-lost').waitFor();
    await daemon.start();
    await page.locator('.banner-lost').waitFor({ state: 'detached' });
    await page.locator('.toast', { hasText: 'is not kept' }).filter({ hasText: 'Now is shown' }).waitFor();
    await eventually(async () => (await shownRev(page)) === 1, () => shownRev(page));
    await eventually(async () => (await track().getAttribute('aria-valuemax')) === '1' && (await said()).startsWith('Now'), said);
    assert.equal(await page.getByRole('status').filter({ hasText: 'As it was' }).count(), 0);
    await edit(() => accent().click());
    assert.equal(await shownRev(page), 2, 'the picture goes on');
    await eventually(async () => (await track().getAttribute('aria-valuemax')) === '2', said);
});
