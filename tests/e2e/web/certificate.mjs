// A certificate for localhost, signed by itself: its own authority. For a day.
import { spawnSync } from 'node:child_process';
import { mkdtempSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

/** Paths, and the options of a daemon that speaks TLS with them. null: there is no openssl. */
export function certificate() {
    const folder = mkdtempSync(join(tmpdir(), 'lumend-e2e-'));
    const [file, key] = ['certificate.pem', 'key.pem'].map((name) => join(folder, name));
    const request = ['req', '-x509', '-newkey', 'ec', '-pkeyopt', 'ec_paramgen_curve:prime256v1', '-nodes', '-days', '1', '-subj', '/CN=localhost'];
    const made = spawnSync('openssl', [...request, '-addext', 'subjectAltName=DNS:localhost', '-out', file, '-keyout', key]);
    return made.status === 0 ? { file, key, options: ['--tls-cert', file, '--tls-key', key] } : null;
}
