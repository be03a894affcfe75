// A line between a client and a daemon, that tests can cut, and make thin.
import { connect, createServer } from 'node:net';

/** A line that is cut once `cut` bytes more have gone up, or a first byte has come down; and is whole again when `open` is. */
export class Line {
    sockets = new Set();
    open = true;
    cut = null;
    /** To the client. */
    bytesPerSecond = Infinity;
    async start(port) {
        this.server = createServer((client) => {
            if (!this.open) return client.destroy();
            const upstream = connect(port, '127.0.0.1');
            this.sockets.add(client).add(upstream);
            client.on('data', (chunk) => this.pass('up', chunk, upstream));
            upstream.on('data', (chunk) => this.bring(chunk, upstream, client));
            for (const [one, other] of [[client, upstream], [upstream, client]]) {
                one.on('error', () => undefined);
                one.on('close', () => other.destroy());
            }
        });
        await new Promise((ready) => this.server.listen(0, '127.0.0.1', ready));
        this.port = this.server.address().port;
    }
    /** What is on the line keeps the next from it. */
    bring(chunk, from, to) {
        if (this.bytesPerSecond === Infinity) return this.pass('down', chunk, to);
        from.pause();
        setTimeout(() => {
            this.pass('down', chunk, to);
            from.resume();
        }, (1000 * chunk.length) / this.bytesPerSecond);
    }
    pass(direction, chunk, to) {
        if (this.cut?.direction === direction && !this.cut.before) to.write(chunk);
        if (this.cut?.direction === direction) return this.break();
        to.write(chunk);
    }
    break() {
        this.open = false;
        this.cut = null;
        for (const socket of this.sockets) socket.destroy();
        this.sockets.clear();
        this.server.emit('cut');
    }
    close() {
        this.break();
        return new Promise((closed) => this.server.close(closed));
    }
}
