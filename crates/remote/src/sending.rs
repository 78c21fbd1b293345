//! Sending blobs that a server lacks: small ones many to a call, large ones as streams.

use std::sync::atomic::Ordering;

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::bytestream::WriteRequest;
use bazel_remote_apis::google::bytestream::byte_stream_client::ByteStreamClient;
use engine::SharedBlob;
use tonic::Status;

use crate::blobs::{batches, storage};
use crate::connection::{Connection, LARGEST_MESSAGE, Server};
use crate::protocol::{blob, digest, digest_of};

/// The most bytes in a message of a stream.
const PIECE: usize = 1 << 20;

/// Sends those of the blobs that the server lacks. `take` returns the bytes of a blob, when it is its turn;
/// one that is gone is left out.
pub(crate) async fn send_missing(
    connection: &Connection,
    server: &Server,
    blobs: Vec<SharedBlob>,
    take: &mut dyn FnMut(SharedBlob) -> Option<Vec<u8>>,
) -> Result<(), Status> {
    let mut missing = self::missing(connection, server, blobs).await?;
    // Many runs need the same large blobs at the same time, such as the program: one sends them, and the
    // others wait until they are there.
    let is_large = |blob: &SharedBlob| blob.bytes > server.batch;
    let _turn = if missing.iter().any(is_large) {
        let turn = connection.turn.lock().await;
        missing = self::missing(connection, server, missing).await?;
        missing.iter().any(is_large).then_some(turn)
    } else {
        None
    };
    for batch in batches(&missing, server.batch) {
        let taken = batch.into_iter().filter_map(|index| Some((missing[index], take(missing[index])?)));
        let parts = taken.collect::<Vec<_>>();
        let bytes = parts.iter().map(|(blob, _)| blob.bytes).sum::<u64>();
        match &parts[..] {
            [] => {}
            [(large, data)] if large.bytes > server.batch => write(connection, server, *large, data).await?,
            _ => update(connection, server, &parts).await?,
        }
        connection.sent.fetch_add(bytes, Ordering::Relaxed);
    }
    Ok(())
}

/// The blobs, among some, that the server lacks.
async fn missing(
    connection: &Connection,
    server: &Server,
    blobs: Vec<SharedBlob>,
) -> Result<Vec<SharedBlob>, Status> {
    let ask = || async {
        let request = re::FindMissingBlobsRequest {
            instance_name: connection.options.instance.clone(),
            blob_digests: blobs.iter().map(|blob| digest(*blob)).collect(),
            digest_function: re::digest_function::Value::Sha256 as i32,
        };
        storage(&server.channel).find_missing_blobs(connection.request(request)).await
    };
    let answer = connection.call(ask).await?.into_inner();
    Ok(answer.missing_blob_digests.iter().filter_map(blob).collect())
}

async fn update(
    connection: &Connection,
    server: &Server,
    parts: &[(SharedBlob, Vec<u8>)],
) -> Result<(), Status> {
    let store = || async {
        let requests = parts.iter().map(|(blob, data)| re::batch_update_blobs_request::Request {
            digest: Some(digest(*blob)),
            data: data.clone(),
            ..Default::default()
        });
        let request = re::BatchUpdateBlobsRequest {
            instance_name: connection.options.instance.clone(),
            requests: requests.collect(),
            digest_function: re::digest_function::Value::Sha256 as i32,
        };
        storage(&server.channel).batch_update_blobs(connection.request(request)).await
    };
    let answer = connection.call(store).await?.into_inner();
    let refused = answer.responses.into_iter().filter_map(|one| one.status).find(|status| status.code != 0);
    match refused {
        Some(status) => Err(Status::new(status.code.into(), status.message)),
        None => Ok(()),
    }
}

/// Sends a large blob as a stream.
async fn write(
    connection: &Connection,
    server: &Server,
    large: SharedBlob,
    data: &[u8],
) -> Result<(), Status> {
    let re::Digest { hash, .. } = digest(large);
    let packed = server
        .has_zstd
        .then(|| ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest));
    let (folder, data) = match &packed {
        Some(packed) => ("compressed-blobs/zstd", &packed[..]),
        None => ("blobs", data),
    };
    // A name for this attempt that no other has: of the blob, the process and its count of calls.
    let send = || async {
        let attempt = (std::process::id(), connection.calls.load(Ordering::Relaxed));
        let unique = digest_of(format!("{hash} {attempt:?}").as_bytes()).hash;
        let unique = format!(
            "{}-{}-4{}-8{}-{}",
            &unique[..8],
            &unique[8..12],
            &unique[12..15],
            &unique[15..18],
            &unique[18..30]
        );
        let name = connection.resource(&format!("uploads/{unique}/{folder}/{hash}/{}", large.bytes));
        let pieces = data.chunks(PIECE).enumerate().map(|(index, piece)| WriteRequest {
            resource_name: if index == 0 { name.clone() } else { String::new() },
            write_offset: (index * PIECE) as i64,
            finish_write: (index + 1) * PIECE >= data.len(),
            data: piece.to_vec(),
        });
        let pieces = tokio_stream::iter(pieces.collect::<Vec<_>>());
        let mut client =
            ByteStreamClient::new(server.channel.clone()).max_encoding_message_size(LARGEST_MESSAGE);
        client.write(connection.request(pieces)).await
    };
    connection.call(send).await.map(drop)
}
