// Files that are sent from the page: dropped, or chosen by the button. Scene: room.jsonl, without an asset folder.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { edit, page, ROOM, serve } from './stage.mjs';

const LAMP = fileURLToPath(new URL('lamp.gltf', import.meta.url));
serve(ROOM);

const notice = (id) => page.locator('.toast', { hasText: `as ${id}` });

function drop(name, text) {
    return page.evaluate(([name, text]) => {
        const dataTransfer = new DataTransfer();
        dataTransfer.items.add(new File([text], name));
        for (const kind of ['dragover', 'drop'])
            document.querySelector('.stage').dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
    }, [name, text]);
}

test('a model is chosen by the button', async () => {
    await edit(() => page.getByLabel('Or send files').setInputFiles(LAMP));
    await notice('lamp').waitFor();
});

test('a model is dropped onto the picture', async () => {
    await edit(() => drop('other.gltf', readFileSync(LAMP, 'utf8')));
    await notice('other').waitFor();
});

test('what is nothing, and what is damaged, is said', async () => {
    await drop('notes.txt', 'x');
    const problem = page.locator('.problem');
    await problem.waitFor();
    assert.match(await problem.innerText(), /None of these files/);
    await drop('broken.glb', 'glTF, so they say');
    await page.locator('.problem', { hasText: 'broken.glb' }).waitFor();
});
