/** A web server that receives events from a door, and answers them with a chosen status. */

import { createServer, type IncomingMessage, type Server } from "node:http";
import type { AddressInfo } from "node:net";

/** What a door posts. */
export interface Message {
  id: string;
  seq: number;
  type: string;
  subject: string;
}

export class Receiver {
  /** Acknowledged messages, oldest first. */
  readonly messages: Message[] = [];
  /** Of the answers from now on. */
  status = 204;

  private constructor(private readonly server: Server) {}

  static async start(): Promise<Receiver> {
    const server = createServer();
    const receiver = new Receiver(server);
    server.on("request", async (request, response) => {
      const message = await receiver.read(request);
      const known = request.headers["webhook-id"] === message.id && request.method === "POST";
      if (known && receiver.status < 300) receiver.messages.push(message);
      response.writeHead(known ? receiver.status : 400).end();
    });
    await new Promise<void>((listening) => server.listen(0, "127.0.0.1", listening));
    return receiver;
  }

  get url(): string {
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}/hook`;
  }

  async end(): Promise<void> {
    this.server.closeAllConnections();
    await new Promise((ended) => this.server.close(ended));
  }

  private async read(request: IncomingMessage): Promise<Message> {
    const chunks: Buffer[] = [];
    for await (const chunk of request) chunks.push(chunk as Buffer);
    return JSON.parse(Buffer.concat(chunks).toString()) as Message;
  }
}
