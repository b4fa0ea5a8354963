"""The physics of one muscle: parameters, laws, memory, air, and the kernel that composes them."""
