"""Physics engines, each behind the protocol of `internav_data.physics.scene.Engine`."""
