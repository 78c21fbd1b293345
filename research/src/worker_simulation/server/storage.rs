//! Blobs, results, and what the server can do.

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::bytestream::byte_stream_server::ByteStream;
use bazel_remote_apis::google::bytestream::{
    QueryWriteStatusRequest, QueryWriteStatusResponse, ReadRequest, ReadResponse, WriteRequest, WriteResponse,
};
use bazel_remote_apis::google::rpc;
use re::action_cache_server::ActionCache;
use re::capabilities_server::Capabilities;
use re::content_addressable_storage_server::ContentAddressableStorage;
use tonic::{Request, Response, Status, Streaming, async_trait};

use super::super::model::{key, locked};
use super::{Answers, Service};

/// A message of a stream.
const PIECE: usize = 1 << 20;

fn unimplemented<T>() -> Result<Response<T>, Status> {
    Err(Status::unimplemented("the model of a server does not have this call"))
}

/// The blob that the name of a stream means: `.../blobs/HASH/SIZE`.
fn blob_of(name: &str) -> Result<re::Digest, Status> {
    let mut parts = name.rsplit('/');
    let (size, hash) = (parts.next(), parts.next());
    let size_bytes = size.and_then(|size| size.parse().ok());
    match (hash, size_bytes, parts.next()) {
        (Some(hash), Some(size_bytes), Some("blobs")) => Ok(re::Digest { hash: hash.into(), size_bytes }),
        _ => Err(Status::invalid_argument(format!("{name} names no blob"))),
    }
}

#[async_trait]
impl ContentAddressableStorage for Service {
    async fn find_missing_blobs(
        &self,
        request: Request<re::FindMissingBlobsRequest>,
    ) -> Result<Response<re::FindMissingBlobsResponse>, Status> {
        self.call("FindMissingBlobs").await;
        let missing_blob_digests = self.model.missing(request.into_inner().blob_digests)?;
        Ok(Response::new(re::FindMissingBlobsResponse { missing_blob_digests }))
    }

    async fn batch_update_blobs(
        &self,
        request: Request<re::BatchUpdateBlobsRequest>,
    ) -> Result<Response<re::BatchUpdateBlobsResponse>, Status> {
        self.call("BatchUpdateBlobs").await;
        let store = |one: re::batch_update_blobs_request::Request| {
            let digest = one.digest.unwrap_or_default();
            let stored = self.model.store(&digest, one.data);
            let status = stored.err().map_or_else(rpc::Status::default, |error| rpc::Status {
                code: error.code() as i32,
                message: error.message().into(),
                ..Default::default()
            });
            re::batch_update_blobs_response::Response { digest: Some(digest), status: Some(status) }
        };
        let responses = request.into_inner().requests.into_iter().map(store).collect();
        Ok(Response::new(re::BatchUpdateBlobsResponse { responses }))
    }

    async fn batch_read_blobs(
        &self,
        request: Request<re::BatchReadBlobsRequest>,
    ) -> Result<Response<re::BatchReadBlobsResponse>, Status> {
        self.call("BatchReadBlobs").await;
        let read = |digest: re::Digest| {
            let data = self.model.read(&digest)?;
            let code = if data.is_some() { tonic::Code::Ok } else { tonic::Code::NotFound };
            Ok(re::batch_read_blobs_response::Response {
                digest: Some(digest),
                data: data.unwrap_or_default(),
                status: Some(rpc::Status { code: code as i32, ..Default::default() }),
                ..Default::default()
            })
        };
        let responses = request.into_inner().digests.into_iter().map(read).collect::<Result<_, Status>>()?;
        Ok(Response::new(re::BatchReadBlobsResponse { responses }))
    }

    type GetTreeStream = Answers<re::GetTreeResponse>;

    async fn get_tree(
        &self,
        _: Request<re::GetTreeRequest>,
    ) -> Result<Response<Self::GetTreeStream>, Status> {
        unimplemented()
    }

    async fn split_blob(
        &self,
        _: Request<re::SplitBlobRequest>,
    ) -> Result<Response<re::SplitBlobResponse>, Status> {
        unimplemented()
    }

    type GetChunkMappingStream = Answers<re::GetChunkMappingResponse>;

    async fn get_chunk_mapping(
        &self,
        _: Request<re::GetChunkMappingRequest>,
    ) -> Result<Response<Self::GetChunkMappingStream>, Status> {
        unimplemented()
    }

    async fn splice_blob(
        &self,
        _: Request<re::SpliceBlobRequest>,
    ) -> Result<Response<re::SpliceBlobResponse>, Status> {
        unimplemented()
    }

    async fn register_chunk_mapping(
        &self,
        _: Request<Streaming<re::RegisterChunkMappingRequest>>,
    ) -> Result<Response<re::RegisterChunkMappingResponse>, Status> {
        unimplemented()
    }
}

#[async_trait]
impl ByteStream for Service {
    type ReadStream = Answers<ReadResponse>;

    async fn read(&self, request: Request<ReadRequest>) -> Result<Response<Self::ReadStream>, Status> {
        self.call("Read").await;
        let request = request.into_inner();
        let blob = self.model.read(&blob_of(&request.resource_name)?)?;
        let blob = blob.ok_or_else(|| Status::not_found(request.resource_name))?;
        let pieces = blob.chunks(PIECE).map(|piece| Ok(ReadResponse { data: piece.to_vec() }));
        Ok(Response::new(Box::pin(tokio_stream::iter(pieces.collect::<Vec<_>>()))))
    }

    async fn write(
        &self,
        request: Request<Streaming<WriteRequest>>,
    ) -> Result<Response<WriteResponse>, Status> {
        self.call("Write").await;
        let mut pieces = request.into_inner();
        let (mut name, mut bytes) = (String::new(), Vec::new());
        while let Some(piece) = pieces.message().await? {
            if name.is_empty() {
                name = piece.resource_name;
            }
            bytes.extend_from_slice(&piece.data);
        }
        let committed_size = bytes.len() as i64;
        self.model.store(&blob_of(&name)?, bytes)?;
        Ok(Response::new(WriteResponse { committed_size }))
    }

    async fn query_write_status(
        &self,
        _: Request<QueryWriteStatusRequest>,
    ) -> Result<Response<QueryWriteStatusResponse>, Status> {
        unimplemented()
    }
}

#[async_trait]
impl ActionCache for Service {
    async fn get_action_result(
        &self,
        request: Request<re::GetActionResultRequest>,
    ) -> Result<Response<re::ActionResult>, Status> {
        self.call("GetActionResult").await;
        let action = key(&request.into_inner().action_digest.unwrap_or_default())?;
        let result = locked(&self.model.results).get(&action).cloned();
        let result = result.ok_or_else(|| Status::not_found("no result"))?;
        // As real servers do: a result without its outputs is none.
        for file in &result.output_files {
            if !self.model.has(&key(file.digest.as_ref().unwrap_or(&re::Digest::default()))?) {
                return Err(Status::not_found("an output is missing"));
            }
        }
        Ok(Response::new(result))
    }

    async fn update_action_result(
        &self,
        request: Request<re::UpdateActionResultRequest>,
    ) -> Result<Response<re::ActionResult>, Status> {
        self.call("UpdateActionResult").await;
        let request = request.into_inner();
        let result = request.action_result.unwrap_or_default();
        let action = key(&request.action_digest.unwrap_or_default())?;
        locked(&self.model.results).insert(action, result.clone());
        Ok(Response::new(result))
    }
}

#[async_trait]
impl Capabilities for Service {
    async fn get_capabilities(
        &self,
        _: Request<re::GetCapabilitiesRequest>,
    ) -> Result<Response<re::ServerCapabilities>, Status> {
        let sha256 = re::digest_function::Value::Sha256 as i32;
        let update = re::ActionCacheUpdateCapabilities { update_enabled: true };
        let cache = re::CacheCapabilities {
            digest_functions: vec![sha256],
            action_cache_update_capabilities: Some(update),
            ..Default::default()
        };
        let execution = re::ExecutionCapabilities {
            digest_function: sha256,
            digest_functions: vec![sha256],
            exec_enabled: true,
            ..Default::default()
        };
        Ok(Response::new(re::ServerCapabilities {
            cache_capabilities: Some(cache),
            execution_capabilities: Some(execution),
            ..Default::default()
        }))
    }
}
