"""A web server that accepts signed events: PORT SECRET FILE. It appends each verified event to FILE as a line of JSON.

The signature is verified by the library of Standard Webhooks.
"""

import http.server
import json
import sys

from standardwebhooks import Webhook

port, secret, file = int(sys.argv[1]), sys.argv[2], sys.argv[3]
webhook = Webhook(secret)


class Receiver(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["content-length"]))
        message = webhook.verify(body.decode(), dict(self.headers.items()))
        with open(file, "a") as lines:
            lines.write(json.dumps(message) + "\n")
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


http.server.ThreadingHTTPServer(("127.0.0.1", port), Receiver).serve_forever()
