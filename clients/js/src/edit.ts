/** Ops that are applied together, all or none. */
import type { Added, Records, Transform } from './records.js';
import type { JsonObject } from './rpc.js';

/** Fields of a record of any type, to be set. */
export type Fields = { [T in keyof Records]: Partial<Records[T]> }[keyof Records];

export class Edit {
    readonly ops: JsonObject[] = [];

    add<T extends keyof Added>(type: T, id: string, fields: Added[T]): void {
        this.ops.push({ op: 'add', type, id, ...fields } as JsonObject);
    }

    set(id: string, fields: Fields): void {
        this.ops.push({ op: 'set', id, path: '', value: fields as unknown as JsonObject });
    }

    /** A part of a field: setPart('key', '/position/1', 2.5). */
    setPart(id: string, path: string, value: number | string | boolean | null | readonly number[]): void {
        this.ops.push({ op: 'set', id, path, value: value as JsonObject['value'] });
    }

    remove(id: string): void {
        this.ops.push({ op: 'remove', id });
    }

    /** A model file of the server's asset folder, as the import `id`: what it makes has ids below that. */
    load(id: string, asset: string, transform?: Transform | readonly number[]): void {
        this.ops.push({ op: 'import', id, asset, ...(transform && { transform }) } as unknown as JsonObject);
    }
}
