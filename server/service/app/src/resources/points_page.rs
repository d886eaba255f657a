//! Display point blocks of a scan, for clients that missed some in the stream.

use std::sync::Arc;

use bytes::{Bytes, BytesMut};
use live::LiveBus;
use live::protocol::points::{HEADER_BYTES, block_length};
use store::{Artifacts, StoreError};
use tokio::io::{AsyncRead, AsyncReadExt};

use crate::evented_catalogue::EventedCatalogue;

/// Maximum bytes per response, unless a single block is larger: 80 frames of a megapixel camera.
const PAGE_BYTES: usize = 8 * 1024 * 1024;

/// Consecutive blocks of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct PointsPage {
    /// The blocks, as the stream sends them.
    pub bytes: Bytes,
    /// Number of the first block not in `bytes`: where the next request continues.
    pub next_block: u32,
    /// Whether these are the last blocks of the scan.
    pub complete: bool,
}

/// The blocks of a scan from number `from_block` on: from memory for the running scan, else from its display artifact.
///
/// # Errors
/// [`StoreError::NotFound`] for an unknown scan, [`StoreError::Damaged`] for an invalid display artifact.
pub async fn points_page(
    live: &LiveBus,
    catalogue: &EventedCatalogue,
    artifacts: &Arc<dyn Artifacts>,
    scan_id: &str,
    from_block: u32,
) -> Result<PointsPage, StoreError> {
    if let Some(page) = live_page(live, scan_id, from_block) {
        return Ok(page);
    }
    let scan = catalogue.read().scan(scan_id).await?;
    let Some(display) = scan.display else {
        return Ok(PointsPage { bytes: Bytes::new(), next_block: 0, complete: true });
    };
    let reader = artifacts.open(&display).await?;
    let damaged = || StoreError::Damaged { id: display.as_str().to_owned() };
    stored_page(reader.bytes, from_block).await.map_err(|_| damaged())
}

/// The blocks of the running scan from number `from_block` on; `None` if it is not this scan.
pub fn live_page(live: &LiveBus, scan_id: &str, from_block: u32) -> Option<PointsPage> {
    let seen = live.watch_points().borrow().clone();
    let log = seen.log_of(scan_id)?;
    let mut bytes = BytesMut::new();
    let mut next_block = from_block;
    while let Some(block) = log.block(next_block) {
        if !bytes.is_empty() && bytes.len() + block.len() > PAGE_BYTES {
            break;
        }
        bytes.extend_from_slice(&block);
        next_block += 1;
    }
    let complete = !seen.running && next_block >= log.n_blocks();
    Some(PointsPage { bytes: bytes.freeze(), next_block, complete })
}

async fn stored_page(mut blocks: impl AsyncRead + Unpin, from_block: u32) -> std::io::Result<PointsPage> {
    let mut bytes = BytesMut::new();
    let mut header = [0; HEADER_BYTES];
    let mut number = 0;
    loop {
        if blocks.read(&mut header[..1]).await? == 0 {
            return Ok(PointsPage { bytes: bytes.freeze(), next_block: number.max(from_block), complete: true });
        }
        blocks.read_exact(&mut header[1..]).await?;
        let length = block_length(&header).ok_or(std::io::ErrorKind::InvalidData)?;
        if number < from_block {
            let skipped = (length - HEADER_BYTES) as u64;
            tokio::io::copy(&mut (&mut blocks).take(skipped), &mut tokio::io::sink()).await?;
        } else if !bytes.is_empty() && bytes.len() + length > PAGE_BYTES {
            return Ok(PointsPage { bytes: bytes.freeze(), next_block: number, complete: false });
        } else {
            let begin = bytes.len();
            bytes.extend_from_slice(&header);
            let rest = (length - HEADER_BYTES) as u64;
            let mut block = (&mut blocks).take(rest);
            while block.read_buf(&mut bytes).await? > 0 {}
            if bytes.len() - begin != length {
                return Err(std::io::ErrorKind::UnexpectedEof.into());
            }
        }
        number += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use live::DisplayPoint;
    use live::protocol::points::encode_block;

    fn blocks(n: u32) -> Vec<Bytes> {
        let point =
            DisplayPoint { xyz_mm: [1.0, 2.0, 3.0], order: 0, intensity: 9.0, sigma_mm: 0.01, along_px: 4.0 };
        (0..n).map(|number| encode_block("x", number, number, 0.0, &vec![point; 30_000])).collect()
    }

    #[tokio::test]
    async fn pages_of_a_stored_scan_join_to_its_blocks() {
        let blocks = blocks(60);
        let artifact = blocks.concat();
        let mut joined = Vec::new();
        let mut next_block = 0;
        loop {
            let page = stored_page(artifact.as_slice(), next_block).await.unwrap();
            assert!(page.bytes.len() <= PAGE_BYTES);
            joined.extend_from_slice(&page.bytes);
            next_block = page.next_block;
            if page.complete {
                break;
            }
        }
        assert_eq!((joined, next_block), (artifact, 60));
    }

    #[tokio::test]
    async fn a_display_artifact_cut_short_is_refused() {
        let artifact = blocks(2).concat();
        for cut in [artifact.len() - 1, artifact.len() / 2 + 3, HEADER_BYTES - 1] {
            assert!(stored_page(&artifact[..cut], 0).await.is_err(), "cut at {cut}");
        }
        assert!(stored_page([7u8; 200].as_slice(), 0).await.is_err());
    }
}
