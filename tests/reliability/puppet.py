"""The file of an actor with few joints."""

PUPPET = """name: puppet
unit: m
color_space: rgb
joints:
  - {name: root_x, parent: world, offset: [0, 0, 0], axis: x, kind: prismatic}
  - {name: root_y, parent: root_x, offset: [0, 0, 0], axis: y, kind: prismatic}
  - {name: root_z, parent: root_y, offset: [0, 0, 0], axis: z, kind: prismatic}
  - {name: root_yaw, parent: root_z, offset: [0, 0, 0], axis: z, kind: revolute}
  - {name: waist, parent: root_yaw, offset: [0, 0, 0.3], axis: y, kind: revolute}
  - {name: neck, parent: waist, offset: [0, 0, 0.3], axis: y, kind: revolute}
dofs:
  - {name: root_x, limits: none, joints: {root_x: 1}}
  - {name: root_y, limits: none, joints: {root_y: 1}}
  - {name: root_z, limits: none, joints: {root_z: 1}}
  - {name: root_yaw, limits: none, joints: {root_yaw: 1}}
  - {name: bend, limits: [-1, 1], joints: {waist: 1, neck: 0.5}}
blobs:
  - {name: legs, joint: root_yaw, offset: [0, 0, 0], sigma: 0.1, color: [0.2, 0.2, 0.6]}
  - {name: trunk, joint: waist, offset: [0, 0, 0.1], sigma: 0.1, color: [0.6, 0.2, 0.2]}
  - {name: head, joint: neck, offset: [0, 0, 0.1], sigma: 0.1, color: [0.8, 0.6, 0.5]}
landmarks:
  - {name: pelvis, joint: root_yaw, offset: [0, 0, 0]}
  - {name: chest, joint: waist, offset: [0.1, 0, 0.1]}
  - {name: neck, joint: neck, offset: [0, 0, 0]}
  - {name: left_elbow, joint: waist, offset: [0, 0.3, 0]}
poses: {rest: {}}
"""
