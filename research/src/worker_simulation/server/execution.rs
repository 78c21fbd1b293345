//! Actions: each waits for a free worker, and holds it for its time.

use std::sync::atomic::Ordering;
use std::time::Instant;

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::longrunning::operations_server::Operations;
use bazel_remote_apis::google::longrunning::{
    CancelOperationRequest, DeleteOperationRequest, GetOperationRequest, ListOperationsRequest,
    ListOperationsResponse, Operation, WaitOperationRequest, operation,
};
use bazel_remote_apis::google::{protobuf, rpc};
use prost::Message as _;
use re::execution_server::Execution;
use tokio::sync::watch;
use tokio_stream::StreamExt as _;
use tonic::{Request, Response, Status, async_trait};

use super::super::model::{key, locked};
use super::{Answers, Running, Service};

/// Counts an action as waiting, as long as it lives: also if it is cancelled.
struct Waiting<'s>(&'s Service);

impl<'s> Waiting<'s> {
    fn new(service: &'s Service) -> Self {
        let waiting = service.model.queue.fetch_add(1, Ordering::Relaxed) + 1;
        service.model.longest_queue.fetch_max(waiting, Ordering::Relaxed);
        Self(service)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.model.queue.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Service {
    /// Runs an action to its end.
    async fn run(&self, action: &re::Digest) -> Result<re::ActionResult, Status> {
        let (text, outputs) = self.model.item(action)?;
        let arrived = Instant::now();
        locked(&self.model.ran).first.get_or_insert(arrived);
        let waiting = Waiting::new(self);
        let worker = self.free.acquire().await.map_err(|_| Status::unavailable("no worker is left"))?;
        drop(waiting);
        let begun = Instant::now();
        let (mut result, time) = self.model.run(&text, outputs)?;
        // What the model itself needs to make the outputs is no part of the time.
        tokio::time::sleep_until((begun + time).into()).await;
        drop(worker);
        let ended = Instant::now();
        result.execution_metadata =
            Some(re::ExecutedActionMetadata { worker: "a model".into(), ..Default::default() });
        locked(&self.model.results).insert(key(action)?, result.clone());
        let mut ran = locked(&self.model.ran);
        ran.actions += 1;
        ran.busy += ended - begun;
        ran.waited += begun - arrived;
        ran.longest_wait = ran.longest_wait.max(begun - arrived);
        ran.last = Some(ended);
        let second = ran.first.map_or(0, |first| (ended - first).as_secs() as usize);
        if ran.by_second.len() <= second {
            ran.by_second.resize(second + 1, 0);
        }
        ran.by_second[second] += 1;
        Ok(result)
    }

    async fn half(&self) {
        if !self.delay.is_zero() {
            tokio::time::sleep(self.delay / 2).await;
        }
    }

    /// The messages of an operation: that it is queued, and its end.
    fn messages(&self, name: String, mut end: watch::Receiver<Option<Operation>>) -> Answers<Operation> {
        let (service, running) = (self.clone(), Operation { name, ..Default::default() });
        let (sender, receiver) = tokio::sync::mpsc::channel(2);
        tokio::spawn(async move {
            let _ = sender.send(Ok(running)).await;
            let ended = match end.wait_for(Option::is_some).await {
                Ok(operation) => operation.clone(),
                Err(_) => None,
            };
            service.half().await;
            let message = ended.ok_or_else(|| Status::internal("the action has no end"));
            let _ = sender.send(message).await;
        });
        Box::pin(tokio_stream::wrappers::ReceiverStream::new(receiver).map(|message| message))
    }
}

/// The last message of an operation.
fn ended(name: &str, result: Result<re::ActionResult, Status>, is_known: bool) -> Operation {
    let status = result.as_ref().err().map(|error| rpc::Status {
        code: error.code() as i32,
        message: error.message().into(),
        ..Default::default()
    });
    let response =
        re::ExecuteResponse { result: result.ok(), cached_result: is_known, status, ..Default::default() };
    let type_url = "type.googleapis.com/build.bazel.remote.execution.v2.ExecuteResponse".into();
    let any = protobuf::Any { type_url, value: response.encode_to_vec() };
    Operation {
        name: name.into(),
        done: true,
        result: Some(operation::Result::Response(any)),
        ..Default::default()
    }
}

#[async_trait]
impl Execution for Service {
    type ExecuteStream = Answers<Operation>;

    async fn execute(
        &self,
        request: Request<re::ExecuteRequest>,
    ) -> Result<Response<Self::ExecuteStream>, Status> {
        self.count("Execute");
        self.half().await;
        let request = request.into_inner();
        let action = request.action_digest.unwrap_or_default();
        let name = format!("operations/{}", self.operations.fetch_add(1, Ordering::Relaxed));
        let known = locked(&self.model.results).get(&key(&action)?).cloned();
        if let (Some(result), false) = (known, request.skip_cache_lookup) {
            let end = watch::Sender::new(Some(ended(&name, Ok(result), true))).subscribe();
            return Ok(Response::new(self.messages(name, end)));
        }
        let (sender, end) = watch::channel(None);
        let (service, of_task) = (self.clone(), name.clone());
        // The task takes its entry away, which has to be there before.
        let mut running = locked(&self.running);
        let task = tokio::spawn(async move {
            let result = service.run(&action).await;
            let _ = sender.send(Some(ended(&of_task, result, false)));
            locked(&service.running).remove(&of_task);
        });
        running.insert(name.clone(), Running { end: end.clone(), task: task.abort_handle() });
        drop(running);
        Ok(Response::new(self.messages(name, end)))
    }

    type WaitExecutionStream = Answers<Operation>;

    async fn wait_execution(
        &self,
        request: Request<re::WaitExecutionRequest>,
    ) -> Result<Response<Self::WaitExecutionStream>, Status> {
        let name = request.into_inner().name;
        let end = locked(&self.running).get(&name).map(|running| running.end.clone());
        let end = end.ok_or_else(|| Status::not_found("no such operation"))?;
        Ok(Response::new(self.messages(name, end)))
    }
}

#[async_trait]
impl Operations for Service {
    async fn list_operations(
        &self,
        _: Request<ListOperationsRequest>,
    ) -> Result<Response<ListOperationsResponse>, Status> {
        Err(Status::unimplemented("operations are not listed"))
    }

    async fn get_operation(&self, _: Request<GetOperationRequest>) -> Result<Response<Operation>, Status> {
        Err(Status::unimplemented("operations are waited for"))
    }

    async fn delete_operation(
        &self,
        _: Request<DeleteOperationRequest>,
    ) -> Result<Response<protobuf::Empty>, Status> {
        Err(Status::unimplemented("operations end by themselves"))
    }

    async fn cancel_operation(
        &self,
        request: Request<CancelOperationRequest>,
    ) -> Result<Response<protobuf::Empty>, Status> {
        if let Some(running) = locked(&self.running).remove(&request.into_inner().name) {
            running.task.abort();
        }
        Ok(Response::new(protobuf::Empty {}))
    }

    async fn wait_operation(&self, _: Request<WaitOperationRequest>) -> Result<Response<Operation>, Status> {
        Err(Status::unimplemented("WaitExecution waits"))
    }
}
