"""How far are the webhooks of a log, and what did they give up? Routes for who administers them; files declare them."""

from fastapi import APIRouter
from starlette.responses import Response

from service.api.messages.answers import answers, json_answer
from service.api.messages.bodies import RetriedWebhook, WebhookList
from service.store.log import EventLog
from service.store.registers.deliveries import Deliveries


def add_webhooks(router: APIRouter, log: EventLog) -> None:
    """Add the routes about webhooks."""
    deliveries = Deliveries(log)

    @router.get("/webhooks", name="webhooks", responses=answers(WebhookList, 422))
    def list_webhooks() -> Response:
        """List up to which event each webhook is, and the events that it gave up."""
        return json_answer(WebhookList(deliveries.states(), deliveries.undelivered()))

    @router.post("/webhooks/{webhook}/retry", name="webhook_retry", responses=answers(RetriedWebhook, 404, 422))
    def retry(webhook: str) -> Response:
        """Let what a webhook gave up be tried once more, by the server that delivers."""
        return json_answer(RetriedWebhook(webhook, deliveries.retry(webhook)))
