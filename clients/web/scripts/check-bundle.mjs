// The page must stay light on a slow line: what it loads at first, and what it may load later, compressed, are under budgets.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const BUDGET_BYTES = 100_000; // what half a second on a slow 4G line, 1.6 Mbit/s, carries
const LATER_BYTES = 26 * 1024; // all of them in little over an eighth of a second, each, of 3.6 KiB at most, in a fiftieth: what is clicked for comes at once

function files(folder) {
    return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
        const path = join(folder, entry.name);
        return entry.isDirectory() ? files(path) : [path];
    });
}

const dist = fileURLToPath(new URL('../dist', import.meta.url));
const page = readFileSync(join(dist, 'index.html'), 'utf8');
/** index.html and what it names; a part that is fetched when it is wanted is named by the others alone. */
const isFirst = (path) => path.endsWith('index.html') || page.includes(path.slice(path.lastIndexOf('/') + 1));
const sizes = files(dist).map((path) => ({ first: isFirst(path), bytes: gzipSync(readFileSync(path), { level: 9 }).length }));
const total = (first) => sizes.reduce((sum, f) => sum + (f.first === first ? f.bytes : 0), 0);
let over = false;
for (const [name, bytes, budget] of [['web client', total(true), BUDGET_BYTES], ['parts of it that come later', total(false), LATER_BYTES]]) {
    const line = `${name}: ${(bytes / 1024).toFixed(1)} KiB gzip of ${(budget / 1024).toFixed(1)} KiB`;
    if (bytes > budget) console.error(`${line}: over budget`);
    else console.log(line);
    over ||= bytes > budget;
}
if (over) process.exit(1);
