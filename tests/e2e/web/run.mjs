// node run.mjs build/release/bin/lumend [name pattern]: the browser tests. Exit status 77: skipped, and why.
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { CHROMIUM } from './browser.mjs';

const [lumend, pattern] = process.argv.slice(2);
if (!lumend) {
    console.error('usage: node run.mjs PATH-OF-LUMEND [NAME-PATTERN]');
    process.exit(2);
}
if (!existsSync(CHROMIUM)) {
    console.log(`skipped: no ${CHROMIUM}`);
    process.exit(77);
}
const folder = fileURLToPath(new URL('.', import.meta.url));
const only = pattern ? [`--test-name-pattern=${pattern}`] : [];
let failed = 0;
// One after the other: two browsers and two daemons at once wait for each other.
for (const file of readdirSync(folder).filter((name) => name.endsWith('.test.mjs'))) {
    const run = spawnSync(process.execPath, ['--test', ...only, join(folder, file)], { stdio: 'inherit', env: { ...process.env, LUMEND: lumend } });
    failed ||= run.status ?? 1;
}
process.exit(failed);
