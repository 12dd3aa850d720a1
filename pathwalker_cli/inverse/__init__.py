"""From recordings to joint angles, ground forces, joint torques and strengths."""
