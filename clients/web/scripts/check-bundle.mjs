// The page must stay light on a slow line: everything it loads, compressed, is under a budget.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const BUDGET_BYTES = 97 * 1024; // what half a second on a slow 4G line, 1.6 Mbit/s, carries

function files(folder) {
    return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
        const path = join(folder, entry.name);
        return entry.isDirectory() ? files(path) : [path];
    });
}

const dist = fileURLToPath(new URL('../dist', import.meta.url));
const total = files(dist).reduce((sum, path) => sum + gzipSync(readFileSync(path), { level: 9 }).length, 0);
const line = `web client: ${(total / 1024).toFixed(1)} KiB gzip of ${BUDGET_BYTES / 1024} KiB`;
if (total > BUDGET_BYTES) {
    console.error(`${line}: over budget`);
    process.exit(1);
}
console.log(line);
