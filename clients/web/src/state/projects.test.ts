import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { JsonObject } from '../protocol/rpc';
import { nameOfCopy, peopleIn, Projects, projectsIn, shortened } from './projects';

const project = (name: string, changedS: number, people: string[] = []): JsonObject => ({ id: name.toLowerCase(), name, changed_s: changedS, open: false, people });

test('what was changed last comes first', () => {
    const list = projectsIn({ projects: [project('Old', 1), project('New', 3), project('Mid', 2), 'junk', project('Also new', 3)] });
    assert.deepEqual(list.map((p) => p.name), ['Also new', 'New', 'Mid', 'Old']);
});

test('a name is as long as the server takes it, and no character is cut in two', () => {
    assert.equal(shortened('é'.repeat(61)), 'é'.repeat(60));
    assert.equal(nameOfCopy('Foyer', new Set()), 'Foyer, copy');
    assert.equal(nameOfCopy('Foyer', new Set(['Foyer, copy', 'Foyer, copy 2'])), 'Foyer, copy 3');
    assert.ok(new TextEncoder().encode(nameOfCopy('é'.repeat(60), new Set())).length <= 120);
});

test('people are counted, and named where they have a name', () => {
    const of = (...people: string[]): ReturnType<typeof projectsIn>[number] => projectsIn({ projects: [project('A', 1, people)] })[0]!;
    assert.equal(peopleIn(of(), false), '');
    assert.equal(peopleIn(of('lumend-web.0-1'), false), 'somebody in it');
    assert.equal(peopleIn(of('ann.0-1.3', 'lumend-web.1-1'), false), '2 in it: ann');
    assert.equal(peopleIn(of('lumend-web.0-1'), true), 'open here');
    assert.equal(peopleIn(of('lumend-web.0-1', 'bob.2-2'), true), 'open here, and by 1 more: bob');
});

test('one that is made is gone to; one that is refused is not', async () => {
    (globalThis as { document?: unknown }).document = { title: '' };
    const went: string[] = [];
    const errors: string[] = [];
    let refuses = false;
    const projects = new Projects({
        call: (method) => (refuses ? Promise.reject(new Error('no')) : Promise.resolve(method === 'project.create' ? { project: 'abc' } : {})),
        onError: (error) => errors.push(error.message),
        announce: () => undefined,
        goTo: (id) => went.push(id),
    });
    assert.equal(projects.online({ projects: true, project: null }), true);
    assert.equal(projects.online({ projects: true, project: { id: 'x', name: 'X' } }), false);
    assert.equal(projects.online({ projects: false, project: null }), false);
    await projects.create('Foyer', 'office');
    assert.deepEqual(went, ['abc']);
    refuses = true;
    await projects.create('Foyer', 'office');
    assert.deepEqual([went, errors], [['abc'], ['no']]);
    assert.equal(projects.busy.value, false);
});

test('what is deleted for ever is not offered to be taken back', async () => {
    const asked: string[] = [];
    const said: string[] = [];
    const projects = new Projects({
        call: (method) => (asked.push(method), Promise.resolve({})),
        onError: () => undefined,
        announce: (text) => said.push(text),
        goTo: () => undefined,
    });
    const [one, other] = ['a', 'b'].map((id) => ({ id, name: id.toUpperCase(), deletedS: 1 }));
    projects.gone.value = one!;
    await projects.erase(other!);
    assert.equal(projects.gone.value, one);
    await projects.erase(one!);
    assert.equal(projects.gone.value, null);
    projects.gone.value = one!;
    await projects.emptyTrash();
    assert.equal(projects.gone.value, null);
    assert.deepEqual(asked.filter((m) => m !== 'project.list'), ['project.erase', 'project.erase', 'trash.empty']);
    assert.deepEqual(said, ['B is deleted for ever', 'A is deleted for ever', 'The trash is empty']);
});
