//! Receiving blobs: small ones many to a call, large ones as streams.

use std::collections::HashMap;
use std::io::Read as _;
use std::sync::atomic::Ordering;

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::bytestream::ReadRequest;
use bazel_remote_apis::google::bytestream::byte_stream_client::ByteStreamClient;
use engine::SharedBlob;
use re::content_addressable_storage_client::ContentAddressableStorageClient;
use tokio::sync::mpsc::Sender;
use tonic::transport::Channel;
use tonic::{Code, Status};

use crate::connection::{Connection, LARGEST_MESSAGE, Server, said};
use crate::protocol::{blob, digest, sha256};

/// Blobs of at most so many bytes together share a call. Some servers allow 2 MiB and do not say so.
pub const BATCH: u64 = 2_000_000;

/// The most blobs in a call.
const MOST_IN_BATCH: usize = 1000;

/// A blob that arrived, by its index; `None` if the server does not have it, or has other bytes.
pub(crate) type Arrived = (usize, Option<Vec<u8>>);

pub(crate) fn storage(channel: &Channel) -> ContentAddressableStorageClient<Channel> {
    ContentAddressableStorageClient::new(channel.clone())
        .max_decoding_message_size(LARGEST_MESSAGE)
        .max_encoding_message_size(LARGEST_MESSAGE)
}

/// The blobs of each call, by index.
pub(crate) fn batches(blobs: &[SharedBlob], limit: u64) -> Vec<Vec<usize>> {
    let mut batches = Vec::new();
    let (mut open, mut bytes) = (Vec::new(), 0);
    for (index, blob) in blobs.iter().enumerate() {
        if blob.bytes > limit {
            batches.push(vec![index]);
            continue;
        }
        if !open.is_empty() && (bytes + blob.bytes > limit || open.len() == MOST_IN_BATCH) {
            batches.push(std::mem::take(&mut open));
            bytes = 0;
        }
        bytes += blob.bytes;
        open.push(index);
    }
    batches.extend((!open.is_empty()).then_some(open));
    batches
}

/// Receives the blobs of one call and sends them on; ends early if nobody takes them.
pub(crate) async fn receive(
    connection: &Connection,
    server: &Server,
    wanted: &[(usize, SharedBlob)],
    sender: &Sender<Arrived>,
) {
    let found = match wanted {
        [(index, large)] if large.bytes > server.batch => {
            let found = stream(connection, server, *large).await;
            found.map(|bytes| vec![(*index, bytes)])
        }
        _ => batch(connection, server, wanted).await,
    };
    let found = found.unwrap_or_else(|status| {
        connection.give_up(format!("{} does not give blobs: {}", connection.options.address, said(&status)));
        wanted.iter().map(|(index, _)| (*index, None)).collect()
    });
    for (index, bytes) in found {
        let expected = wanted.iter().find(|(wanted, _)| *wanted == index).map(|(_, blob)| *blob);
        let is_good = |bytes: &Vec<u8>| {
            expected.is_some_and(|blob| blob.bytes == bytes.len() as u64 && sha256(bytes) == blob.hash)
        };
        let good = match bytes {
            Some(bytes) if is_good(&bytes) => Some(bytes),
            Some(_) => {
                let address = &connection.options.address;
                connection.say(format!(
                    "{address} gave a blob with other bytes than its digest says; its item is made here"
                ));
                None
            }
            None => None,
        };
        let bytes = good.as_ref().map_or(0, Vec::len) as u64;
        connection.received.fetch_add(bytes, Ordering::Relaxed);
        if sender.send((index, good)).await.is_err() {
            return;
        }
    }
}

async fn batch(
    connection: &Connection,
    server: &Server,
    wanted: &[(usize, SharedBlob)],
) -> Result<Vec<Arrived>, Status> {
    let ask = || async {
        let request = re::BatchReadBlobsRequest {
            instance_name: connection.options.instance.clone(),
            digests: wanted.iter().map(|(_, blob)| digest(*blob)).collect(),
            digest_function: re::digest_function::Value::Sha256 as i32,
            ..Default::default()
        };
        storage(&server.channel).batch_read_blobs(connection.request(request)).await
    };
    let responses = connection.call(ask).await?.into_inner().responses;
    let mut data = HashMap::new();
    for response in responses {
        let is_there = response.status.as_ref().is_none_or(|status| status.code == 0);
        if let (Some(found), true) = (response.digest.as_ref().and_then(blob), is_there) {
            data.insert(found.hash.0, response.data);
        }
    }
    Ok(wanted.iter().map(|(index, blob)| (*index, data.get(&blob.hash.0).cloned())).collect())
}

/// A large blob; `None` if the server does not have it.
async fn stream(
    connection: &Connection,
    server: &Server,
    wanted: SharedBlob,
) -> Result<Option<Vec<u8>>, Status> {
    let re::Digest { hash, .. } = digest(wanted);
    let folder = if server.has_zstd { "compressed-blobs/zstd" } else { "blobs" };
    let name = connection.resource(&format!("{folder}/{hash}/{}", wanted.bytes));
    let read = || async {
        let request = ReadRequest { resource_name: name.clone(), read_offset: 0, read_limit: 0 };
        let mut client =
            ByteStreamClient::new(server.channel.clone()).max_decoding_message_size(LARGEST_MESSAGE);
        // A large blob may take long, but each part of it comes within the time limit.
        let mut stream = connection.within(client.read(connection.request(request))).await?.into_inner();
        let mut all = Vec::new();
        while let Some(message) = connection.within(stream.message()).await? {
            // What is compressed may be a little longer than what it holds.
            if (all.len() + message.data.len()) as u64 > wanted.bytes + wanted.bytes / 64 + 4096 {
                return Ok(None);
            }
            all.extend_from_slice(&message.data);
        }
        Ok(Some(all))
    };
    match connection.retry(read).await {
        Ok(Some(bytes)) if server.has_zstd => Ok(unpacked(&bytes, wanted.bytes)),
        Err(status) if status.code() == Code::NotFound => Ok(None),
        found => found,
    }
}

/// The bytes in Zstandard's data; `None` if it is damaged or holds more than it should.
fn unpacked(bytes: &[u8], expected: u64) -> Option<Vec<u8>> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(bytes).ok()?;
    let mut all = Vec::new();
    decoder.take(expected + 1).read_to_end(&mut all).ok()?;
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_blobs_share_a_call_and_large_ones_have_their_own() {
        let blob = |bytes: u64| SharedBlob { hash: sha256(&bytes.to_le_bytes()), bytes };
        let sizes = [10, 20, 101, 50, 40, 60];
        let found = batches(&sizes.map(blob), 100);
        assert_eq!(found, [vec![2], vec![0, 1, 3], vec![4, 5]]);
        let many = vec![blob(0); 2500];
        assert_eq!(batches(&many, 100).iter().map(Vec::len).collect::<Vec<_>>(), [1000, 1000, 500]);
        assert!(batches(&[], 100).is_empty());
    }

    #[test]
    fn a_bomb_is_cut_off() {
        let bytes = vec![0; 1 << 20];
        let packed =
            ruzstd::encoding::compress_to_vec(&bytes[..], ruzstd::encoding::CompressionLevel::Fastest);
        assert_eq!(unpacked(&packed, 1 << 20).unwrap(), bytes);
        assert_eq!(unpacked(&packed, 1000).unwrap().len(), 1001);
        assert_eq!(unpacked(b"light", 5), None);
    }
}
