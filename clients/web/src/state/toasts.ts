/** Short messages in the corner, and the same for screen readers. */
import { signal } from '@preact/signals';

export interface ToastAction {
    label: string;
    run(): void;
}

export interface Toast {
    key: number;
    kind: 'error' | 'info';
    text: string;
    /** What can be done about it; taking one closes the message. */
    actions: readonly ToastAction[];
}

const LIFETIME_MS = { error: 9000, info: 4000 };
/** A choice must not run away from who reads slowly or comes by keyboard. */
const OFFER_LIFETIME_MS = 30000;
const MAX_SHOWN = 4;

export class Toasts {
    readonly shown = signal<readonly Toast[]>([]);
    /** Announced politely to assistive technology. */
    readonly announced = signal('');
    private nextKey = 1;

    error(error: Error): void {
        this.show('error', error.message);
    }

    info(text: string, actions: readonly ToastAction[] = []): void {
        this.show('info', text, actions);
    }

    announce(text: string): void {
        this.announced.value = text;
    }

    dismiss(key: number): void {
        this.shown.value = this.shown.value.filter((t) => t.key !== key);
    }

    private show(kind: Toast['kind'], text: string, actions: readonly ToastAction[] = []): void {
        const others = this.shown.value.filter((t) => t.text !== text);
        const toast = { key: this.nextKey++, kind, text, actions };
        this.shown.value = [...others, toast].slice(-MAX_SHOWN);
        setTimeout(() => this.dismiss(toast.key), actions.length > 0 ? OFFER_LIFETIME_MS : LIFETIME_MS[kind]);
    }
}
