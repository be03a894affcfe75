/** Browser storage that may be switched off: then nothing is remembered, and that is all. */

export function remember(storage: 'localStorage' | 'sessionStorage', key: string, value: string): void {
    try {
        window[storage].setItem(key, value);
    } catch {
        // Private window, quota, policy.
    }
}

export function recall(storage: 'localStorage' | 'sessionStorage', key: string): string | null {
    try {
        return window[storage].getItem(key);
    } catch {
        return null;
    }
}
