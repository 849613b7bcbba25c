"""ICP-based motion estimation from 2D LiDAR scans."""
