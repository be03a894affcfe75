/** The access token: from the address once, then only in this tab's session storage, so that it is not shared by accident. */

const KEY = 'lumend.token';

export function takeToken(): string | null {
    const match = /[#&]t=([^&]+)/.exec(location.hash);
    if (match) {
        keepToken(decodeURIComponent(match[1]!));
        history.replaceState(null, '', location.pathname + location.search);
    }
    try {
        return sessionStorage.getItem(KEY);
    } catch {
        return match ? decodeURIComponent(match[1]!) : null;
    }
}

export function keepToken(token: string): void {
    try {
        sessionStorage.setItem(KEY, token);
    } catch {
        // Storage is switched off: the token lives as long as the page.
    }
}
