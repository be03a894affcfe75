/** The access token: from the address once, then only in this tab's session storage, so that it is not shared by accident. */
import { recall, remember } from '../lib/store';

/** Of this path alone: a proxy may have another server, with other tokens, at another path. */
const key = (): string => `lumend.token ${new URL('.', location.href).pathname}`;

export const takeToken = (): string | null => tokenInAddress() ?? recall('sessionStorage', key());

/** Takes it out of the address, which may name a view, too. */
export function tokenInAddress(): string | null {
    const match = /[#&]t=([^&]+)/.exec(location.hash);
    if (!match) return null;
    const token = decodeURIComponent(match[1]!);
    keepToken(token);
    const rest = location.hash.replace(/^#/, '').split('&').filter((part) => !part.startsWith('t=')).join('&');
    history.replaceState(null, '', location.pathname + location.search + (rest && `#${rest}`));
    return token;
}

export function keepToken(token: string): void {
    remember('sessionStorage', key(), token);
}
