/** That of the client for scripts: there is one. */
export * from '../../../js/src/frame';
