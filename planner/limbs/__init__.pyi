from .limb_chain import LimbChain as LimbChain
