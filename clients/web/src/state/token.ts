/** The access token: from the address once, then only in this tab's session storage, so that it is not shared by accident. */
import { recall, remember } from '../lib/store';

const KEY = 'lumend.token';

export function takeToken(): string | null {
    const match = /[#&]t=([^&]+)/.exec(location.hash);
    if (!match) return recall('sessionStorage', KEY);
    const token = decodeURIComponent(match[1]!);
    keepToken(token);
    history.replaceState(null, '', location.pathname + location.search);
    return token;
}

export function keepToken(token: string): void {
    remember('sessionStorage', KEY, token);
}
