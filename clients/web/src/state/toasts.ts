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

const LIFETIME_MS = { error: 20000, info: 6000 };
/** A choice must not run away from who reads slowly or comes by keyboard. */
const OFFER_LIFETIME_MS = 30000;
const MAX_SHOWN = 4;

export class Toasts {
    readonly shown = signal<readonly Toast[]>([]);
    /** Announced politely to assistive technology. */
    readonly announced = signal('');
    private nextKey = 1;
    private held = false;
    private readonly timers = new Map<number, ReturnType<typeof setTimeout>>();

    error(error: Error): void {
        this.show('error', error.message);
    }

    info(text: string, actions: readonly ToastAction[] = []): void {
        this.show('info', text, actions);
        const offer = actions.map((a) => a.label).join(', ');
        this.announce(offer ? `${text}. ${offer}: in the corner` : text);
    }

    announce(text: string): void {
        this.announced.value = text;
    }

    dismiss(key: number): void {
        clearTimeout(this.timers.get(key));
        this.timers.delete(key);
        this.shown.value = this.shown.value.filter((t) => t.key !== key);
    }

    /** While one is pointed at, or has the focus, all stay: nothing moves away under who reads. */
    hold(): void {
        for (const timer of this.timers.values()) clearTimeout(timer);
        this.timers.clear();
        this.held = true;
    }

    release(): void {
        this.held = false;
        for (const t of this.shown.value) this.expire(t);
    }

    private expire(toast: Toast): void {
        if (this.held) return;
        clearTimeout(this.timers.get(toast.key));
        const after = toast.actions.length > 0 ? OFFER_LIFETIME_MS : LIFETIME_MS[toast.kind];
        this.timers.set(toast.key, setTimeout(() => this.dismiss(toast.key), after));
    }

    private show(kind: Toast['kind'], text: string, actions: readonly ToastAction[] = []): void {
        const others = this.shown.value.filter((t) => t.text !== text);
        const toast = { key: this.nextKey++, kind, text, actions };
        this.shown.value = [...others, toast].slice(-MAX_SHOWN);
        this.expire(toast);
    }
}
