import assert from 'node:assert/strict';
import { test } from 'node:test';
import { may, roleOf, type Role } from './role';

test('each role may do what those before it may', () => {
    const order: Role[] = ['view', 'measure', 'edit', 'admin'];
    order.forEach((has, i) => order.forEach((needs, j) => assert.equal(may(has, needs), i >= j, `${has} ${needs}`)));
});

test('what a server does not say, or says anew, hides nothing', () => {
    assert.equal(roleOf('view'), 'view');
    for (const said of [undefined, null, 'owner', 7]) assert.equal(roleOf(said), 'edit');
});
