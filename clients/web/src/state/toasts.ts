/** Short messages in the corner, and the same for screen readers. */
import { signal } from '@preact/signals';
import { RpcError } from '../protocol/rpc';

export interface Toast {
    key: number;
    kind: 'error' | 'info';
    text: string;
    /** Which field it is about, as the server names it. */
    path: string;
}

const LIFETIME_MS = { error: 9000, info: 4000 };
const MAX_SHOWN = 4;

export class Toasts {
    readonly shown = signal<readonly Toast[]>([]);
    /** Announced politely to assistive technology. */
    readonly announced = signal('');
    private nextKey = 1;

    error(error: Error): void {
        this.show('error', error.message, error instanceof RpcError ? error.path : '');
    }

    info(text: string): void {
        this.show('info', text, '');
    }

    announce(text: string): void {
        this.announced.value = text;
    }

    dismiss(key: number): void {
        this.shown.value = this.shown.value.filter((t) => t.key !== key);
    }

    private show(kind: Toast['kind'], text: string, path: string): void {
        const same = this.shown.value.find((t) => t.text === text && t.path === path);
        if (same) this.dismiss(same.key);
        const toast = { key: this.nextKey++, kind, text, path };
        this.shown.value = [...this.shown.value, toast].slice(-MAX_SHOWN);
        setTimeout(() => this.dismiss(toast.key), LIFETIME_MS[kind]);
    }
}
