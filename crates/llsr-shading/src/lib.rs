//! Direct light of linear lights by every visibility search method, and the tile renderer.
