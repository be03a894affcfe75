/** A list of lines of which one is a stop of the Tab key, and, when there are many, only those in sight are drawn. */
import { useSignal } from '@preact/signals';
import type { RefObject } from 'preact';
import { useEffect, useLayoutEffect, useRef } from 'preact/hooks';
import { inSight, layoutOf, type Line } from '../state/listing';
import { useApp } from './context';
import { toStage } from './focus';

/** Up to so many are all drawn. */
const FEW = 60;
/** Until a line has been drawn. */
const ROW_PX = 58;
/** Drawn beyond both ends of what is in sight; and how finely scrolling is followed. */
const MARGIN_PX = 400;
const STEP_PX = 200;

/** What a line needs to know of its place. */
export interface Place {
    index: number;
    count: number;
    /** Its controls are stops of the Tab key. */
    reachable: boolean;
    /** Pixels from the top of a long list; null: it follows the one before. */
    top: number | null;
}

/** Attributes of the <li>. */
export function lineProps({ index, count, top }: Place): Record<string, unknown> {
    return {
        'data-line': index,
        'aria-posinset': index + 1,
        'aria-setsize': count,
        style: top === null ? undefined : { transform: `translateY(${top}px)` },
    };
}

interface Lines {
    list: RefObject<HTMLUListElement | null>;
    /** Indices. */
    shown: number[];
    /** Of a long list. */
    height: number | null;
    active: number;
    onKeyDown(e: KeyboardEvent): void;
    onFocus(e: FocusEvent): void;
    placeOf(i: number): Omit<Place, 'reachable'>;
}

export function useLines(lines: readonly Line[], selected: string | null): Lines {
    const app = useApp();
    const list = useRef<HTMLUListElement>(null);
    const heights = useRef(new Map<string, number>());
    const measured = useSignal(0);
    const sight = useSignal<[number, number]>([0, 1200]);
    const activeKey = useSignal('');
    const toFocus = useRef<{ key: string; column: string } | null>(null);

    const long = lines.length > FEW;
    const indexOf = (key: string | null): number => lines.findIndex((l) => l.key === key);
    const active = Math.max(0, indexOf(activeKey.value));
    void measured.value;
    const layout = layoutOf(lines.map((l) => heights.current.get(l.key) ?? ROW_PX));
    const shown = long ? inSight(layout, ...sight.value, [active, indexOf(selected)]) : lines.map((_, i) => i);

    const scroller = (): HTMLElement | null => list.current?.closest<HTMLElement>('.sections') ?? null;
    const follow = (): void => {
        const box = scroller()?.getBoundingClientRect();
        const top = list.current?.getBoundingClientRect().top ?? 0;
        if (!box) return;
        const from = Math.floor((box.top - top - MARGIN_PX) / STEP_PX) * STEP_PX;
        const to = from + Math.ceil((box.height + 2 * MARGIN_PX) / STEP_PX + 1) * STEP_PX;
        if (from !== sight.peek()[0] || to !== sight.peek()[1]) sight.value = [from, to];
    };
    const showLine = (i: number): void => {
        const panel = scroller();
        if (!panel || !long || i < 0) return;
        const top = list.current!.getBoundingClientRect().top - panel.getBoundingClientRect().top + layout.tops[i]!;
        if (top < 0 || top + ROW_PX > panel.clientHeight) panel.scrollTop += top - panel.clientHeight / 3;
    };

    useEffect(() => {
        const panel = scroller();
        if (!panel || !long) return;
        follow();
        const observer = new ResizeObserver(follow);
        observer.observe(panel);
        panel.addEventListener('scroll', follow, { passive: true });
        return () => {
            observer.disconnect();
            panel.removeEventListener('scroll', follow);
        };
    }, [long]);
    // Lines are as high as they turn out to be: the selected one shows its details.
    useLayoutEffect(() => {
        if (!long) return;
        let changed = false;
        for (const element of list.current!.querySelectorAll<HTMLElement>('[data-line]')) {
            const key = lines[Number(element.dataset.line)]?.key;
            const px = element.offsetHeight;
            if (key === undefined || heights.current.get(key) === px) continue;
            heights.current.set(key, px);
            changed = true;
        }
        if (changed) measured.value++;
    });
    useLayoutEffect(() => {
        const wanted = toFocus.current;
        const line = wanted && list.current?.querySelector<HTMLElement>(`[data-line="${indexOf(wanted.key)}"]`);
        if (!line) return;
        toFocus.current = null;
        const control = line.querySelector<HTMLElement>(`[data-column="${wanted.column}"]`) ?? line.querySelector<HTMLElement>('[data-column="name"]');
        control?.focus();
    });
    useEffect(() => showLine(indexOf(selected)), [selected]);

    const goTo = (i: number, column: string): void => {
        const line = lines[Math.min(lines.length - 1, Math.max(0, i))];
        if (!line) return;
        toFocus.current = { key: line.key, column };
        showLine(indexOf(line.key));
        activeKey.value = line.key;
    };
    const onKeyDown = (e: KeyboardEvent): void => {
        const target = e.target as HTMLElement;
        const column = target.dataset.column;
        const line = lines[lineOf(target)];
        if (!line || !column || e.altKey) return;
        const at = lines.indexOf(line);
        const { selection } = app;
        const take = (): void => {
            e.preventDefault();
            e.stopPropagation();
        };
        const ctrl = e.ctrlKey || e.metaKey;
        if (ctrl && e.key === 'a') {
            take();
            selection.set(lines.flatMap((l) => ('id' in l ? [l.id] : l.isOpen ? [] : [...l.ids])));
        } else if (e.key === ' ' && column === 'name' && 'id' in line && (ctrl || selection.many.peek().length > 0)) {
            take();
            selection.toggle(line.id);
        }
        if (ctrl || e.key === ' ') return;
        if (e.key === 'Delete' && 'id' in line) {
            take();
            const many = selection.many.peek().includes(line.id);
            const goes = (l: Line): boolean => ('id' in l ? [l.id] : l.ids).every((id) => id === line.id || (many && selection.chosen.peek().has(id)));
            const next = lines.slice(at + 1).find((l) => !goes(l)) ?? lines.slice(0, at).reverse().find((l) => !goes(l));
            void (many ? selection.remove() : app.lamps.remove(line.id)).then((gone) => {
                if (gone && next) goToKey(next.key);
                else if (gone) toStage();
            });
            return;
        }
        const to: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: lines.length - 1 };
        const i = to[e.key];
        if (i === undefined || target.matches('input')) return;
        take();
        const next = lines[Math.min(lines.length - 1, Math.max(0, i))]!;
        if (e.shiftKey && 'id' in next && column === 'name') {
            if (selection.ids.peek().length === 0 && 'id' in line) selection.set([line.id]);
            selection.rangeTo(next.id, lines.flatMap((l) => ('id' in l ? [l.id] : [])));
        }
        goTo(i, column);
    };
    const goToKey = (key: string): void => {
        toFocus.current = { key, column: 'name' };
        activeKey.value = key;
        measured.value++;
    };
    const onFocus = (e: FocusEvent): void => {
        const line = lines[lineOf(e.target as HTMLElement)];
        if (line) activeKey.value = line.key;
    };
    return {
        list,
        shown,
        height: long ? layout.height : null,
        active,
        onKeyDown,
        onFocus,
        placeOf: (i) => ({ index: i, count: lines.length, top: long ? layout.tops[i]! : null }),
    };
}

const lineOf = (element: HTMLElement): number => Number(element.closest<HTMLElement>('[data-line]')?.dataset.line ?? -1);
